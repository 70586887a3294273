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
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.pair_motion import PairMotion
from odeform.motion.recent import Recent, geometry_key
from odeform.motion.trajectory import Adjusted, Shown
from odeform.schema import Parameters
from odeform.types import Floats, Geometry, Times

__all__ = ["Shapes", "pair_motion", "pair_problem"]

Readout = Callable[[Times, Floats], Floats]
SHAPES = 4  # that are kept


def pair_problem(body: LoadedBody, pair: Pair, situation: Situation, read: Readout) -> Problem:
    """The problem of two bodies, of which the first one is thrown at the other one. `read` is the readout of one."""

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
    apart = Apart(inside, body.both, body.anchor, trajectory.states)
    kept, ground = Shown(trajectory, lambda _, y: y), model.ground_of(parameters)
    trajectories = tuple(Adjusted(kept, _of(index)) for index in range(2))
    return PairMotion.of(
        model.schema, parameters, both, evaluated, trajectories, model.validity, model.checked_body, ground, apart
    )


def _of(index: int) -> Callable[[Times, Floats], Float[np.ndarray, "times y"]]:
    return lambda _, y: y[:, index]

