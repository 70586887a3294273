"""What all models of reduced motions share: geometry in, cached basis, motion out."""

from abc import ABC, abstractmethod
from collections import OrderedDict
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.errors import InputError
from odeform.model.expected import ExpectedError
from odeform.model.motion import Motion, Trajectory
from odeform.model.placed import PlacedBasis, place
from odeform.model.reduced import ReducedSpace
from odeform.schema import Parameters
from odeform.solver.frontier import FrontierPoint
from odeform.solver.integrate import Quality
from odeform.types import Floats, Geometry, Mesh, Times

__all__ = ["ReducedModel"]

CACHED = 4  # geometries (or headings) whose basis is kept


class ReducedModel(ABC):
    """A predictor of reduced coordinates. Subclasses say how y(t) comes from parameters."""

    model: ClassVar[str]
    qualities: Mapping[str, Quality] = {}
    """Ways to integrate, by name; empty for models that do not integrate."""
    frontier: tuple[FrontierPoint, ...] = ()
    """The ways to choose from, cheap to fine; empty for models that do not integrate, and in older checkpoints."""

    def __init__(self, checkpoint: Checkpoint) -> None:
        try:
            self.checkpoint = checkpoint
            self.schema = checkpoint.schema
            self.rest = Mesh(checkpoint.arrays["rest.points"], checkpoint.arrays["rest.faces"])
            self.space = ReducedSpace.from_parts(checkpoint.config["space"], checkpoint.arrays, self.rest)
            self._expected = ExpectedError(checkpoint.arrays) if "val.theta" in checkpoint.arrays else None
            self._read(checkpoint)
        except (KeyError, TypeError, ValueError, IndexError) as error:
            raise InputError(f"checkpoint of {checkpoint.model}: missing or wrong {error}") from None
        self._placed: OrderedDict[tuple[int, float], tuple[Geometry, PlacedBasis]] = OrderedDict()

    @abstractmethod
    def _read(self, checkpoint: Checkpoint) -> None:
        """Take what this model needs; KeyError where it is missing."""

    @abstractmethod
    def _trajectory(self, theta: Floats, placed: PlacedBasis, quality: Quality | None, until: float) -> Trajectory: ...

    def place(self, geometry: Geometry, azimuth: float) -> PlacedBasis:
        """The basis on a geometry; kept for the last few."""
        key = (id(geometry), azimuth)
        if key not in self._placed:
            if not np.isfinite(geometry.points).all() or len(geometry.points) == 0:
                raise InputError("geometry: expected at least one point, all finite")
            self._placed[key] = (geometry, place(geometry, self.space, azimuth))
            if len(self._placed) > CACHED:
                self._placed.popitem(last=False)
        self._placed.move_to_end(key)
        return self._placed[key][1]

    def expected_error(self, parameters: Parameters, times: Times) -> Floats | None:
        """(T, 2) mm RMSE at (T,) seconds, which half and nine in ten of unseen motions of the trained body keep to.

        None where the checkpoint knows nothing of validation.
        """
        return None if self._expected is None else self._expected.at(self.schema.vector(parameters), times)

    def _quality(self, quality: str | Quality) -> Quality | None:
        if not self.qualities or isinstance(quality, Quality):
            return quality if isinstance(quality, Quality) else None
        if quality not in self.qualities:
            raise InputError(f"unknown quality {quality!r}: expected one of {', '.join(self.qualities)}")
        return self.qualities[quality]

    def solve(
        self,
        geometry: Geometry | None = None,
        parameters: Mapping[str, Any] | None = None,
        quality: str | Quality = "balanced",
        until: float | None = None,
        observed: None = None,
    ) -> Motion:
        """The motion of `geometry` (default: the body the model was trained on) under `parameters`.

        The geometry lies in the scene as at rest. Integrates to `until` seconds (default: the trained window); the
        motion can be asked beyond and then integrates on. Beyond what was trained motions fade: models see parameters
        and times that `Schema.seen` and `Window.seen` bound.
        """
        if observed is not None:
            raise InputError(f"{self.model}: predicts from parameters alone and takes no observed frames")
        complete: Parameters = self.schema.complete(parameters)
        shape = self.rest if geometry is None else geometry
        placed = self.place(shape, self.schema.azimuth(complete))
        window = self.schema.window
        span = float(window.seen(np.array(window.stop if until is None else until)))
        trajectory = self._trajectory(self.schema.seen(complete), placed, self._quality(quality), span)
        return Motion(self.schema, complete, shape, self.space, placed, trajectory)
