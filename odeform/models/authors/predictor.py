"""The authors' networks, ready to predict: on the frames that they were trained on, and cubic between these."""

import time
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from odeform.checkpoint import Checkpoint
from odeform.dataset.importers.authors import AUTHORS_MASS_ELASTIC
from odeform.errors import InputError
from odeform.geometry.shape import surface_weights
from odeform.models.authors.file import MODEL
from odeform.models.authors.network import Networks, normalisation
from odeform.models.base import Predictor
from odeform.motion.base import SolveStats
from odeform.motion.basis import DisplacementBasis
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.local_frames import LocalFrames
from odeform.motion.reduced_motion import ReducedMotion
from odeform.motion.reduced_space import POSE, ReducedSpace
from odeform.schema import Parameters
from odeform.solver.integrate import SolverSettings
from odeform.types import Frames, GaussianSplats, Geometry, MotionSequence, Times

__all__ = ["AuthorsModel"]

SCALES = {1: 2.0, 3: 5.0}  # of offsets, by their numbers
LARGEST = 3.0  # mass or bending that the network sees as 1; it sees 0 as -1
STAGES = 4  # of a step
CACHED = 4  # bodies brought to their own frame that are kept


@dataclass(frozen=True, eq=False)
class _Frames:
    """Motion between frames: a cubic spline through each, the first and the last held beyond.

    `offsets` (T, 3) metres. The deformation is a sum of the frames' own, one mode each.
    """

    times: Times
    offsets: Float[np.ndarray, "times 3"]
    stats: SolveStats
    last_good: float = float("inf")

    def reduced(self, times: Times) -> Float[np.ndarray, "asked y"]:
        frames = np.eye(len(self.times))
        knots = np.concatenate([self.offsets, np.zeros((len(frames), POSE - 3)), frames], axis=1)
        return CubicSpline(self.times, knots)(np.clip(times, self.times[0], self.times[-1]))


class _EvaluatedFrames(EvaluatedBasis):
    """A body, and how each frame displaces its points: nothing is known between them."""

    @cached_property
    def local_frames(self) -> LocalFrames:
        raise InputError("released: a latent for each point tells nothing of gradients; expected a mesh or points")


class AuthorsModel(Predictor):
    """A network of the paper's authors: shapes are predicted, not displacements, so that P(0) is only nearly P0.

    A geometry is taken as it is, in metres and in its own frame: the world adds the offset that is predicted.
    """

    model = MODEL
    rescales_input = False
    extrapolates = False

    def _read(self, checkpoint: Checkpoint) -> None:
        self._networks = Networks.read(checkpoint.arrays)
        first, count = checkpoint.config["first_frame"], checkpoint.config["frames"]
        times = np.arange(first, first + count) / self.schema.window.rate
        # the authors' own clock
        self._times = np.round(times, 2) if self.schema.scene == AUTHORS_MASS_ELASTIC else times
        if (np.diff(self._times) <= 0.0).any():
            raise ValueError(f"frames at least 10 ms apart, at {self.schema.window.rate:g} a second")
        self._seated: OrderedDict[tuple[int, tuple[float, ...]], tuple[Geometry, Geometry]] = OrderedDict()

    def to_body_frame(self, geometry: Geometry, parameters: Mapping[str, Any]) -> Geometry:
        """A body that lies in the scene, in its own frame: less the initial offset. Kept for the last few."""
        offset = self._offset(self.schema.complete(parameters))
        key = (id(geometry), tuple(offset))
        if key not in self._seated:
            moved = replace(geometry, points=np.asarray(geometry.points, dtype=float) - offset)
            self._seated[key] = (geometry, moved)
            if len(self._seated) > CACHED:
                self._seated.popitem(last=False)
        return self._seated[key][1]

    def _solve(
        self,
        geometry: Geometry,
        parameters: Parameters,
        settings: SolverSettings | None,
        until: float,
        observed: MotionSequence | None,
    ) -> ReducedMotion:
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
            f"RK4 (3/8 rule) on the trained {rate:g} Hz grid, cubic between its frames",
            steps,
            2 * STAGES * steps,
            0,
            "ok" if np.isfinite(frames).all() and np.isfinite(offsets).all() else "not finite",
            1e3 * (time.perf_counter() - begin),
            lambda: None,
        )
        trajectory = _Frames(self._times, offsets, stats)
        evaluated = _place(geometry, frames)
        return ReducedMotion(self.schema, parameters, geometry, evaluated.space, evaluated, trajectory)

    def _offset(self, parameters: Parameters) -> Float[np.ndarray, " 3"]:
        """(3,) metres at first."""
        given = [value for name, value in parameters.items() if name.startswith("initial_offset")]
        return np.array([0.0] * (3 - len(given)) + given)

    def _frames(self, shape: Geometry, parameters: Parameters) -> tuple[Float[np.ndarray, "times 3"], Frames]:
        """Offsets (T, 3) and displacements (T, N, 3) from the rest, in metres."""
        numbers, rest = self._networks.offsets, np.asarray(shape.points, dtype=float)
        theta = np.array([value for name, value in parameters.items() if not name.startswith("initial_offset")])
        if self.schema.scene == AUTHORS_MASS_ELASTIC:
            theta = 2.0 * (theta / LARGEST - 0.5)
        middle, half = normalisation(rest)
        scale = SCALES[numbers]
        offsets, frames = self._networks.solve(
            (rest - middle) / half, theta, scale * self._offset(parameters)[-numbers:], self._times
        )
        # a height is the last of three
        whole = np.pad(offsets.astype(float) / scale, ((0, 0), (3 - numbers, 0)))
        return whole, half * frames + (middle - rest)


def _place(shape: Geometry, frames: Frames) -> EvaluatedBasis:
    """Motions of a shape as sums of its displacements (T, N, 3)."""
    points = np.asarray(shape.points, dtype=np.float32)
    count = len(points)
    still = [np.tile(np.eye(3), count), points.reshape(1, -1)]
    rows = np.concatenate([*still, frames.reshape(len(frames), -1)]).astype(np.float32)
    none = DisplacementBasis(np.zeros((1, 3)), np.zeros((5, 0)), 1.0)
    space = ReducedSpace(np.zeros(3), 1.0, none, None)
    reach = np.linalg.norm(frames, axis=2).max(axis=1)
    return _EvaluatedFrames(shape, space, 0.0, points, points, rows, reach, surface_weights(shape))
