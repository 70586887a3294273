"""The base class of all models: parameters and a shape in, a motion out."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.errors import InputError
from odeform.models.error_band import ErrorBand
from odeform.models.frontier import FrontierPoint
from odeform.motion.base import Motion
from odeform.schema import Parameters
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Geometry, Mesh, MotionSequence, Times

__all__ = ["Predictor", "check_finite"]


def check_finite(geometry: Geometry) -> None:
    """`InputError` for a shape without points, or with points that are not finite."""
    if not np.isfinite(geometry.points).all() or len(geometry.points) == 0:
        raise InputError("geometry: expected at least one point, all finite")


class Predictor(ABC):
    """A trained model of one scene. `odeform.load` returns one.

    Attributes:
        checkpoint: The file it was read from: provenance, scores, SHA-256.
        schema: Its parameters and window of time.
        rest: The trained body at rest, N vertices in metres.

    Examples:
        >>> import odeform
        >>> predictor = odeform.load("kick")
        >>> motion = predictor.solve(parameters={"mass": 0.6, "force": 140.0})
        >>> motion.vertices(0.02).shape
        (2306, 3)
        >>> band = predictor.error_band(motion.parameters, predictor.schema.window.times)
        >>> band.shape
        (121, 2)

    A subclass sets `model`, reads its arrays in `_read` and predicts in `_solve`; how it is trained stands with it
    too (`odeform.models.registry`).
    """

    model: str
    """The name under which checkpoints and the command line know this class."""
    qualities: Mapping[str, SolverSettings] = {}
    """Solver settings by name (draft, balanced, reference); empty for models that do not integrate."""
    frontier: tuple[FrontierPoint, ...] = ()
    """The measured solver settings, cheap to fine; empty for models without, and in older checkpoints."""
    rescales_input: bool = True
    """Whether a foreign shape is moved and scaled to fit `rest`; otherwise it is taken as it is, in metres."""
    extrapolates: bool = True
    """Whether motions continue beyond the trained window; otherwise only the window can be scored."""

    def __init__(self, checkpoint: Checkpoint) -> None:
        try:
            self.checkpoint = checkpoint
            self.schema = checkpoint.schema
            self.rest = Mesh(checkpoint.arrays["rest.points"], checkpoint.arrays["rest.faces"])
            self._error_band = ErrorBand(checkpoint.arrays) if "val.theta" in checkpoint.arrays else None
            self._read(checkpoint)
        except (KeyError, TypeError, ValueError, IndexError) as error:
            raise InputError(f"checkpoint of {checkpoint.model}: missing or wrong {error}") from None

    @abstractmethod
    def _read(self, checkpoint: Checkpoint) -> None:
        """Take what this model needs; KeyError or ValueError where it is missing or wrong."""

    @abstractmethod
    def _solve(
        self,
        geometry: Geometry,
        parameters: Parameters,
        settings: SolverSettings | None,
        until: float,
        observed: MotionSequence | None,
    ) -> Motion:
        """As `solve`, with everything filled in: all parameters, the settings (None for a model without qualities
        that was given a quality by name), and the end in seconds, soft-clamped to what models are asked for."""

    def solve(
        self,
        geometry: Geometry | None = None,
        parameters: Mapping[str, Any] | None = None,
        quality: str | SolverSettings = "balanced",
        until: float | None = None,
        observed: MotionSequence | None = None,
    ) -> Motion:
        """The motion of `geometry` under `parameters`.

        Args:
            geometry: a shape of N points in metres, where it lies at rest in the scene; the trained body by default.
            parameters: by name, in the units of `schema`; defaults for the others.
            quality: the name of one of `qualities`, or solver settings.
            until: seconds that are integrated at once (default: the trained window). Later times may be evaluated
                too and continue the integration. Beyond the trained range parameters and times are soft-clipped
                (`Schema.inputs`, `Window.soft_clamped`), so that motions stay bounded.
            observed: the frames between which a model with `schema.needs_observations` interpolates.

        Raises:
            InputError: for a shape, parameter, quality or observation that this model cannot use.
        """
        self._check_observed(observed)
        window = self.schema.window
        end = float(window.soft_clamped(np.array(window.stop if until is None else until)))
        shape = self.rest if geometry is None else geometry
        return self._solve(shape, self.schema.complete(parameters), self._settings(quality), end, observed)

    def error_band(self, parameters: Parameters, times: Times) -> Floats | None:
        """(T, 2) RMSE in mm at (T,) seconds that half, and nine in ten, of unseen motions of the trained body stay
        within. None where the checkpoint holds no validation errors."""
        return None if self._error_band is None else self._error_band.at(self.schema.vector(parameters), times)

    def to_body_frame(self, geometry: Geometry, parameters: Mapping[str, Any]) -> Geometry:
        """A body at rest in the scene, in the frame in which `solve` expects it: here the scene's own."""
        return geometry

    def _check_observed(self, observed: MotionSequence | None) -> None:
        if observed is not None and not self.schema.needs_observations:
            raise InputError(f"{self.model}: predicts from parameters alone and takes no observed frames")
        if observed is None and self.schema.needs_observations:
            raise InputError(f"{self.model}: interpolates between observed frames, and none were given")

    def _settings(self, quality: str | SolverSettings) -> SolverSettings | None:
        """None for a model without qualities that is given one by name."""
        if not self.qualities or isinstance(quality, SolverSettings):
            return quality if isinstance(quality, SolverSettings) else None
        if quality not in self.qualities:
            raise InputError(f"unknown quality {quality!r}: expected one of {', '.join(self.qualities)}")
        return self.qualities[quality]
