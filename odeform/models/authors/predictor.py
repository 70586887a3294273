"""The networks of the paper's authors, ready to predict: on the frames they were trained on, and cubic in between."""

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

from odeform.checkpoint import Checkpoint
from odeform.dataset.importers.authors import AUTHORS_MASS_ELASTIC
from odeform.errors import InputError
from odeform.models.authors.file import MODEL
from odeform.models.authors.motion import FrameMotion
from odeform.models.authors.network import Networks, normalisation
from odeform.models.base import Predictor
from odeform.motion.base import SolveStats
from odeform.motion.recent import Recent, geometry_key
from odeform.schema import Parameters
from odeform.solver.integrate import SolverSettings
from odeform.types import Frames, GaussianSplats, Geometry, Mesh, MotionSequence

__all__ = ["AuthorsModel"]

SCALES = {1: 2.0, 3: 5.0}  # of offsets, by their number of components
LARGEST = 3.0  # mass or bending that is 1 to the network; 0 is -1
STAGES = 4  # of a step
CACHED = 4  # bodies in their own frame that are kept


class AuthorsModel(Predictor):
    """A network of the paper's authors: it predicts shapes, not displacements, so that P(0) is only close to P0.

    A geometry is taken as it is, in metres and in its own frame: the world adds the predicted offset.
    """

    model = MODEL
    rescales_input = False
    extrapolates = False

    def _read(self, checkpoint: Checkpoint) -> None:
        self._networks = Networks.read(checkpoint.arrays)
        first, count = checkpoint.config["first_frame"], checkpoint.config["frames"]
        times = np.arange(first, first + count) / self.schema.window.rate
        # the authors round times to 10 ms in this scene
        self._times = np.round(times, 2) if self.schema.scene == AUTHORS_MASS_ELASTIC else times
        if (np.diff(self._times) <= 0.0).any():
            raise ValueError(f"frames at least 10 ms apart, at {self.schema.window.rate:g} per second")
        self._in_body_frame: Recent[tuple[Geometry, Geometry]] = Recent(CACHED)

    @property
    def bodies(self) -> tuple[Mesh, ...]:
        """None: the file does not hold the body that was trained."""
        return ()

    def to_body_frame(self, geometry: Geometry, parameters: Mapping[str, Any]) -> Geometry:
        """A body at rest in the scene, in its own frame: without the initial offset. The last few are kept."""
        offset = self._offset(self.schema.complete(parameters))

        def moved() -> tuple[Geometry, Geometry]:
            return geometry, replace(geometry, points=np.asarray(geometry.points, dtype=float) - offset)

        return self._in_body_frame.get((geometry_key(geometry), tuple(offset)), moved)[1]

    def _solve(
        self,
        geometry: Geometry,
        parameters: Parameters,
        settings: SolverSettings | None,
        until: float,
        observed: MotionSequence | None,
    ) -> FrameMotion:
        """The geometry, in its own frame (default: a ball), is its own reference of normalisation.

        Always one step per trained frame, for any quality and end: other frames would change the network's answer.
        """
        if isinstance(geometry, GaussianSplats):
            raise InputError("released: cannot deform splats; expected a mesh or points")
        points = geometry.points
        if len(points) < 2 or not np.isfinite(points).all() or np.ptp(points, axis=0).max() <= 0.0:
            raise InputError("geometry: expected at least two distinct points, all finite")
        begin = time.perf_counter()
        offsets, frames = self._frames(geometry, parameters)
        rate, steps = self.schema.window.rate, len(self._times) - 1
        stats = SolveStats(
            f"RK4 (3/8 rule) on the trained {rate:g} Hz grid, cubic between frames",
            steps,
            2 * STAGES * steps,
            0,
            "ok" if np.isfinite(frames).all() and np.isfinite(offsets).all() else "not finite",
            1e3 * (time.perf_counter() - begin),
            lambda: None,
        )
        return FrameMotion(self.schema, parameters, geometry, self._times, offsets, frames, stats)

    def _offset(self, parameters: Parameters) -> Float[np.ndarray, " 3"]:
        """(3,) metres at the start."""
        given = [value for name, value in parameters.items() if name.startswith("initial_offset")]
        return np.array([0.0] * (3 - len(given)) + given)

    def _frames(self, shape: Geometry, parameters: Parameters) -> tuple[Float[np.ndarray, "times 3"], Frames]:
        """Offsets (T, 3) and displacements (T, N, 3) from rest, in metres."""
        components, rest = self._networks.offsets, np.asarray(shape.points, dtype=float)
        theta = np.array([value for name, value in parameters.items() if not name.startswith("initial_offset")])
        if self.schema.scene == AUTHORS_MASS_ELASTIC:
            theta = 2.0 * (theta / LARGEST - 0.5)
        middle, half = normalisation(rest)
        scale = SCALES[components]
        offsets, frames = self._networks.solve(
            (rest - middle) / half, theta, scale * self._offset(parameters)[-components:], self._times
        )
        # a single component is a height, the last of three
        padded = np.pad(offsets.astype(float) / scale, ((0, 0), (3 - components, 0)))
        return padded, half * frames + (middle - rest)
