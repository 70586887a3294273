"""Motions of a body that is thrown at a twin of itself: one solution, and where both are."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from odeform.geometry.twins import are_twins, half_of, twins_of
from odeform.loads.situation import Situation
from odeform.mechanics.apart import Apart
from odeform.mechanics.inside import Inside
from odeform.mechanics.pair import Pair
from odeform.models.modal.loaded import LoadedBody
from odeform.models.reduced_model import ReducedModel
from odeform.models.solved import Problem, SolvedTrajectory
from odeform.motion.base import SolveStats
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.pair_motion import PairMotion
from odeform.motion.recent import Recent, geometry_key
from odeform.schema import Parameters
from odeform.types import Floats, Geometry, Times

__all__ = ["Shapes", "pair_motion", "pair_problem"]

Readout = Callable[[Times, Floats], Floats]
SHAPES, RECENT = 4, 4  # shapes and results that are kept


def pair_problem(body: LoadedBody, pair: Pair, situation: Situation, read: Readout) -> Problem:
    """The problem of two bodies, of which the first one is thrown at the other one.

    `read` is the readout of one; that of both is (T, 2, 6 + K).
    """

    def both(times: Times, states: Floats) -> Floats:
        each = states.reshape(len(states), 2, -1)
        return np.stack([read(times, each[:, index]) for index in range(2)], axis=1)

    return Problem(pair, body.begin_pair(situation).ravel(), both, at_rest=False)


class Shapes:
    """Shapes of one body and of two, each as the other."""

    def __init__(self) -> None:
        self._known: Recent[tuple[Geometry, Geometry]] = Recent(SHAPES)

    def twins(self, geometry: Geometry) -> Geometry:
        """Two like this one, which may be two already."""
        return self._both(geometry)[1]

    def one(self, geometry: Geometry) -> Geometry:
        """The one of two like ones, which may be one already."""
        return self._both(geometry)[0]

    def _both(self, geometry: Geometry) -> tuple[Geometry, Geometry]:
        known = next((both for both in self._known.values if any(geometry is one for one in both)), None)
        return known or self._known.get(geometry_key(geometry), lambda: _both(geometry))


def _both(geometry: Geometry) -> tuple[Geometry, Geometry]:
    return (half_of(geometry), geometry) if are_twins(geometry) else (geometry, twins_of(geometry))


def pair_motion(
    model: ReducedModel,
    both: Geometry,
    evaluated: EvaluatedBasis,
    parameters: Parameters,
    trajectory: SolvedTrajectory,
    body: LoadedBody,
    inside: Inside,
) -> PairMotion:
    """The motion of two shapes, from the basis on one of them and a trajectory of both, (T, 2, 6 + K)."""
    apart, kept = Apart(inside, body.both, body.anchor, trajectory.states), Recent[Floats](RECENT)
    trajectories = tuple(_OneOf(trajectory, index, kept) for index in range(2))
    return PairMotion.of(
        model.schema,
        parameters,
        both,
        evaluated,
        trajectories,
        model.validity,
        model.checked_body,
        model.ground_of(parameters),
        apart,
    )


class _OneOf:
    """The trajectory of one of two bodies that are solved for together."""

    def __init__(self, both: SolvedTrajectory, index: int, kept: Recent[Floats]) -> None:
        """`kept` are the last results of both."""
        self._both, self._index, self._kept = both, index, kept

    @property
    def stats(self) -> SolveStats:
        """How both were computed."""
        return self._both.stats

    @property
    def last_good(self) -> float:
        """Seconds up to which both are valid."""
        return self._both.last_good

    def reduced(self, times: Times) -> Float[np.ndarray, "times y"]:
        """Maps (T,) s to (T, 6 + K)."""
        asked = np.asarray(times, dtype=float)
        return self._kept.get(asked.tobytes(), lambda: self._both.reduced(asked))[:, self._index]
