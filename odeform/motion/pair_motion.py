"""The motion of two like bodies: the points of the one, then those of the other."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.geometry.shape_similarity import ShapeSimilarity
from odeform.motion.base import Motion, SolveStats
from odeform.motion.body import CheckedBody
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.ground import Ground
from odeform.motion.plausibility import PlausibilityCheck, Sample
from odeform.motion.reduced_motion import ReducedMotion
from odeform.motion.trajectory import Trajectory
from odeform.motion.validity import UNKNOWN, Validity
from odeform.schema import Parameters, Schema
from odeform.types import Frames, Geometry, Matrices, Points, Pose, Times

__all__ = ["PairMotion"]


@dataclass(frozen=True, eq=False)
class One(ReducedMotion):
    """One of two bodies, which are shown at the same moment: where either is not possible, both are held."""

    check: PlausibilityCheck | None = None

    def _make_check(self) -> PlausibilityCheck | None:
        return self.check


@dataclass(frozen=True, eq=False)
class PairMotion(Motion):
    """Two bodies of N points each. Its points are those of both; its pose is that of the first one, and so is what
    moves along with it. Each one's local displacement is in its own axes."""

    schema: Schema
    parameters: Parameters
    geometry: Geometry
    """Both where they rest, in one place."""
    both: tuple[One, One]
    keep_apart: Callable[[Times, Float[np.ndarray, "times 2 points 3"]], None]
    """Moves points of both, m at (T,) s, out of each other."""
    validity: Validity = UNKNOWN

    @classmethod
    def of(
        cls,
        schema: Schema,
        parameters: Parameters,
        geometry: Geometry,
        evaluated: EvaluatedBasis,
        trajectories: Sequence[Trajectory],
        validity: Validity,
        body: CheckedBody,
        ground: Ground | None,
        keep_apart: Callable[[Times, Float[np.ndarray, "times 2 points 3"]], None],
    ) -> "PairMotion":
        """Two bodies of the shape of `evaluated`, which `geometry` has twice, on two trajectories."""

        def sample(times: Times) -> Sample:
            each = [body.sample(one.reduced(times), schema.window.passed(times)) for one in trajectories]
            lowest, deformation = (np.stack([getattr(s, name) for s in each]) for name in ("lowest", "deformation"))
            return Sample(lowest.min(axis=0), deformation.max(axis=0), each[0].centre)

        check = PlausibilityCheck(validity.limits, schema.window, sample)
        one, other = (
            One(
                schema,
                parameters,
                evaluated.geometry,
                evaluated.space,
                evaluated,
                trajectory,
                validity,
                body,
                ground,
                check,
            )
            for trajectory in trajectories
        )
        return cls(schema, parameters, geometry, (one, other), keep_apart, validity)

    def _make_check(self) -> PlausibilityCheck | None:
        return self.both[0].plausibility

    @property
    def similarity(self) -> ShapeSimilarity | None:  # pyright: ignore[reportIncompatibleVariableOverride]
        """How similar each of the two is to the trained bodies."""
        return self.both[0].similarity

    @property
    def stats(self) -> SolveStats:
        return self.both[0].stats

    @property
    def last_good(self) -> float:
        return self.both[0].last_good

    def vertices(self, t: float | Times) -> Points | Frames:
        times = np.atleast_1d(np.asarray(t, dtype=float))
        out = np.stack([one.vertices(times) for one in self.both], axis=1)
        if len(times):
            self.keep_apart(self._clock(times), out)
        out = out.reshape(len(times), len(self.geometry.points), 3)
        return out[0] if np.ndim(t) == 0 else out

    def pose(self, t: float | Times) -> Pose:
        return self.both[0].pose(t)

    def placement(self, t: float | Times) -> Pose:
        still = np.eye(4)
        return still if np.ndim(t) == 0 else np.tile(still, (len(np.asarray(t)), 1, 1))

    def local(self, t: float | Times) -> Points | Frames:
        return np.concatenate([one.local(t) for one in self.both], axis=-2)

    def deformed(self, t: float) -> Points:
        return self.vertices(t)

    def covariances(self, t: float) -> Matrices:
        return np.concatenate([one.covariances(t) for one in self.both])

    def deformed_covariances(self, t: float) -> Matrices:
        return self.covariances(t)

    def deformation_bound(self, time: float) -> float:
        moved = self.vertices(time) - self.geometry.points
        return float(np.sqrt(np.einsum("ni,ni->n", moved, moved).max()))

    def deformation_rms(self, times: Times) -> Times:
        return np.sqrt(np.mean([one.deformation_rms(times) ** 2 for one in self.both], axis=0))
