"""Load `hold`: a body is held in the air by a patch of its surface, hangs from it and swings."""

from dataclasses import replace

import numpy as np

from odeform.errors import InputError
from odeform.loads.arrow import Arrow
from odeform.loads.drop import PARAMETERS, WINDOW, height_of, turn_of
from odeform.loads.load import Load
from odeform.loads.situation import Clamp, Flight, Situation
from odeform.schema import Parameter, Parameters
from odeform.types import Mesh, Points, Vector

__all__ = ["LOAD", "held_vertex"]

RADIUS = 0.12  # of the body's size: where the springs of the patch are softer by a factor e
SINK, DAMPING = 5e-4, 2e-3  # m and s, of the springs
LENGTH = 0.25  # of the body's size: the arrow that points at the patch
HEIGHT = replace(PARAMETERS[0], default=0.3)


def _towards(parameters: Parameters) -> Vector:
    """(3,) the unit vector from the middle of the resting body towards where it is held."""
    around, up = (np.radians(float(parameters[name])) for name in ("held_around", "held_up"))
    if not np.isfinite([around, up]).all():
        raise InputError("held_around, held_up: expected finite angles in degrees")
    return np.array([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)])


def held_vertex(points: Points, parameters: Parameters) -> int:
    """The vertex of a resting body (N, 3) m that is nearest to a place far away in the direction asked for."""
    low, high = points.min(axis=0), points.max(axis=0)
    far = 0.5 * (low + high) + float((high - low).max()) * _towards(parameters)
    return int(((points - far) ** 2).sum(axis=1).argmin())


def situation(rest: Mesh, parameters: Parameters) -> Situation:
    """The body in the air, held."""
    flight = Flight(height_of(parameters), turn_of(parameters))
    radius = RADIUS * float(np.ptp(rest.points, axis=0).max())
    return Situation(flight, clamp=Clamp(held_vertex(rest.points, parameters), radius, SINK, DAMPING))


def arrows(start: Mesh, parameters: Parameters) -> tuple[Arrow, ...]:
    """An arrow that points from outside at the patch, as long as it is held."""
    turn, points = turn_of(parameters), np.asarray(start.points, dtype=float)
    resting = points @ turn
    vector = -LENGTH * float(np.ptp(resting, axis=0).max()) * (turn @ _towards(parameters))
    vertex = held_vertex(resting, parameters)
    return (Arrow(points[vertex] - vector, vector, "held", 0.0, np.inf, vertex=vertex),)


LOAD = Load(
    name="hold",
    title="Hold it",
    happened="held",
    parameters=(
        Parameter(
            "held_around",
            "deg",
            -180.0,
            180.0,
            -120.0,
            description="of the held patch about z, from the middle of the body",
        ),
        Parameter(
            "held_up",
            "deg",
            -90.0,
            90.0,
            30.0,
            description="of the held patch above the horizontal, from the middle",
        ),
        HEIGHT,
        *PARAMETERS[1:],
    ),
    window=WINDOW,
    until=3.0,
    situation=situation,
    presets={
        "by its side": {"held_up": 0.0},
        "from above": {"held_up": 90.0},
        "like a pendulum": {"held_up": 60.0, "turn_y": -60.0},
        "upside down": {"held_up": -60.0, "turn_x": 180.0},
        "it touches the floor": {"held_up": 0.0, "height": 0.05},
    },
    notes=(
        "The body begins in the air, without stress. Springs and dampers hold a patch of its surface where it begins; "
        "they get softer with the distance from its middle, to a third at an eighth of the body's size.",
    ),
    arrows=arrows,
    held=True,
)
