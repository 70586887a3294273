"""Load `wall`: a body is thrown against a wall, and falls on the floor in front of it."""

import numpy as np

from odeform.errors import InputError
from odeform.loads.drop import PARAMETERS, WINDOW
from odeform.loads.load import Load
from odeform.loads.obstacle import Obstacle, half_space
from odeform.loads.situation import Situation, beginning_outside
from odeform.loads.throw import SPINS, arrows, flight_of, velocity
from odeform.schema import Parameter, Parameters
from odeform.types import Mesh

__all__ = ["DISTANCE", "LOAD", "distance_of"]

FARTHEST = 100.0  # m
WIDE, HIGH = 0.45, 0.6  # m, of what is drawn, to each side and above the floor
DISTANCE = Parameter("distance", "m", 0.25, 0.5, 0.35, description="from the body's middle to the obstacle, along x")


def distance_of(parameters: Parameters) -> float:
    """Metres; `InputError` for none, and for one that no throw covers."""
    distance = float(parameters["distance"])
    if not 0.0 < distance <= FARTHEST:
        raise InputError(f"distance: expected more than 0 and at most {FARTHEST:g} m, got {distance:g}")
    return distance


def wall(distance: float) -> Obstacle:
    """Everything at x >= distance m."""
    place, normal = np.array([distance, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0])
    return half_space(place, normal, (-WIDE, WIDE), (0.0, HIGH), "wall")


def obstacles(parameters: Parameters) -> tuple[Obstacle, ...]:
    """The wall."""
    return (wall(distance_of(parameters)),)


def situation(rest: Mesh, parameters: Parameters) -> Situation:
    """The body in the air, on its way to the wall."""
    return beginning_outside(rest, flight_of(parameters), obstacles(parameters), "wall")


LOAD = Load(
    name="wall",
    title="Throw it against a wall",
    happened="thrown against a wall",
    parameters=(
        DISTANCE,
        *PARAMETERS,
        velocity("x", 1.0, 3.0, 2.5),
        velocity("y", -1.0, 1.0, 0.0),
        velocity("z", -0.5, 1.5, 0.5),
        *SPINS,
    ),
    window=WINDOW,
    until=2.0,
    situation=situation,
    presets={
        "straight at it": {"spin_y": 0.0},
        "fast, with topspin": {"velocity_x": 3.0, "spin_y": 10.0},
        "at an angle, spinning": {"velocity_y": 1.0, "spin_y": 0.0, "spin_z": 10.0},
        "a lob": {"velocity_x": 1.5, "velocity_z": 1.5, "spin_y": -6.0},
        "flat along the floor": {"height": 0.05, "velocity_x": 3.0, "velocity_z": 0.0, "spin_y": 0.0},
    },
    notes=(
        "The body begins in the air, without stress, and is thrown against a wall as rough and stiff as the floor.",
    ),
    arrows=arrows,
    obstacles=obstacles,
)
