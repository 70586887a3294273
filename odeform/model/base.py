"""What all models of reduced motions share: geometry in, cached basis, motion out."""

from abc import abstractmethod
from collections import OrderedDict
from collections.abc import Mapping
from typing import Any

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.model.motion import Motion, Trajectory
from odeform.model.placed import PlacedBasis, place
from odeform.model.reduced import ReducedSpace
from odeform.model.trained import TrainedModel, check_finite
from odeform.schema import Parameters
from odeform.solver.integrate import Quality
from odeform.types import Floats, Geometry, Sequence

__all__ = ["ReducedModel"]

CACHED = 4  # geometries (or headings) whose basis is kept


class ReducedModel(TrainedModel):
    """A predictor of reduced coordinates. Subclasses say how y(t) comes from parameters."""

    def _read(self, checkpoint: Checkpoint) -> None:
        self.space = ReducedSpace.from_parts(checkpoint.config["space"], checkpoint.arrays, self.rest)
        self._placed: OrderedDict[tuple[int, float], tuple[Geometry, PlacedBasis]] = OrderedDict()

    @abstractmethod
    def _trajectory(self, theta: Floats, placed: PlacedBasis, quality: Quality | None, until: float) -> Trajectory: ...

    def place(self, geometry: Geometry, azimuth: float) -> PlacedBasis:
        """The basis on a geometry; kept for the last few."""
        key = (id(geometry), azimuth)
        if key not in self._placed:
            check_finite(geometry)
            self._placed[key] = (geometry, place(geometry, self.space, azimuth))
            if len(self._placed) > CACHED:
                self._placed.popitem(last=False)
        self._placed.move_to_end(key)
        return self._placed[key][1]

    def solve(
        self,
        geometry: Geometry | None = None,
        parameters: Mapping[str, Any] | None = None,
        quality: str | Quality = "balanced",
        until: float | None = None,
        observed: Sequence | None = None,
    ) -> Motion:
        shape = self._shape(geometry, observed)
        complete: Parameters = self.schema.complete(parameters)
        placed = self.place(shape, self.schema.azimuth(complete))
        window = self.schema.window
        span = float(window.seen(np.array(window.stop if until is None else until)))
        trajectory = self._trajectory(self.schema.seen(complete), placed, self._quality(quality), span)
        return Motion(self.schema, complete, shape, self.space, placed, trajectory)
