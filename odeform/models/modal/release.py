"""Restarts the ODE of a pushed body from the state to which the residual has moved it.

While a sphere pushes, contact decides what follows, and most of the error arises. Once it is gone, the mechanics knows
what a body does; a regression of whole motions does not. So the residual corrects the rigid motion until then, and its
last correction is part of the state from which the ODE goes on.
"""

import numpy as np
from jaxtyping import Float

from odeform.mechanics.flat import body_motion, parts_of
from odeform.models.modal.coordinates import Coordinates
from odeform.types import Floats, Times, Vectors

__all__ = ["before", "released"]

DISTANCE = 1e-3  # s between the times whose differences give the velocity, all of them before it
BACKWARD = np.array([1.0, -4.0, 3.0]) / (2.0 * DISTANCE)  # of second order


def before(time: float) -> Times:
    """(3,) s: the times at which motions have to be known for their state at `time`."""
    return time - DISTANCE * np.array([2.0, 1.0, 0.0])


def released(
    coordinates: Coordinates,
    states: Float[np.ndarray, "3 state"],
    pose: Float[np.ndarray, "3 6"],
    scale: float,
) -> Float[np.ndarray, " state"]:
    """The state of a body at the last of the times `before`, with the deformation of `states` (3, 20 + 2 K), and with
    the place and velocity of its pose (3, 6). Amplitudes of `coordinates` are `scale` times those of states."""
    shift, rotation = coordinates.placed(pose, scale * body_motion(states)[2])
    out: Floats = states[-1].copy()
    place, turn, *_, velocity = parts_of(states)
    out[place], out[turn] = shift[-1], rotation[-1].ravel()
    start = velocity.start
    out[start : start + 3] = BACKWARD @ shift
    out[start + 3 : start + 6] = BACKWARD @ _small(rotation @ rotation[-1].T)
    return out


def _small(turns: Float[np.ndarray, "times 3 3"]) -> Vectors:
    """(T, 3) rad of small rotations."""
    return 0.5 * np.stack(
        [turns[:, 2, 1] - turns[:, 1, 2], turns[:, 0, 2] - turns[:, 2, 0], turns[:, 1, 0] - turns[:, 0, 1]], axis=1
    )
