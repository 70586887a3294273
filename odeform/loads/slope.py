"""Load `slope`: a body is let down on a slope, on which it stays, slides or rolls, to the floor at its foot."""

import math

import numpy as np

from odeform.errors import InputError
from odeform.geometry.rigid import rotation_from_vector
from odeform.loads.drop import HIGHEST, PARAMETERS, WINDOW, height_of, turn_of
from odeform.loads.load import Load
from odeform.loads.obstacle import Obstacle, half_space
from odeform.loads.situation import Flight, Situation, beginning_outside
from odeform.loads.throw import SPINS, flight_of, velocity
from odeform.loads.wall import DISTANCE, distance_of
from odeform.schema import Parameter, Parameters
from odeform.types import Mesh, Points

__all__ = ["LOAD"]

FLATTEST, STEEPEST = 1.0, 75.0  # degrees; one that is level is the floor, and a steep one is high where the body begins
WIDE, UP = 0.35, 0.3  # m, of what is drawn: to each side, and beyond the body
STILL = {"velocity_y": 0.0, "velocity_z": 0.0, "spin_x": 0.0, "spin_z": 0.0}  # of a throw, what no slider changes


def angle_of(parameters: Parameters) -> float:
    """rad; `InputError` for a slope that is level or a wall."""
    angle = float(parameters["angle"])
    if not FLATTEST <= angle <= STEEPEST:
        raise InputError(f"angle: expected a slope of {FLATTEST:g} to {STEEPEST:g} degrees, got {angle:g}")
    return math.radians(angle)


def slope(distance: float, angle: float) -> Obstacle:
    """Falls along x at an angle in rad, and meets the floor at x = distance m."""
    normal = np.array([math.sin(angle), 0.0, math.cos(angle)])
    up = (distance + UP) / math.cos(angle)
    return half_space(np.array([distance, 0.0, 0.0]), normal, (-WIDE, WIDE), (-up, 0.0), "slope")


def flight_over(rest: Points, parameters: Parameters) -> Flight:
    """The body above the slope, turned from how it would lie there."""
    angle, distance, above = angle_of(parameters), distance_of(parameters), height_of(parameters)
    thrown = flight_of({**parameters, **STILL})
    rotation = rotation_from_vector(np.array([0.0, angle, 0.0])) @ turn_of(parameters)
    turned = (rest - rest.mean(axis=0, dtype=float)) @ rotation.T
    normal = slope(distance, angle).turn[:, 2]
    centre = (above + distance * normal[0] - float((turned @ normal).min())) / normal[2]
    return Flight(centre + float(turned[:, 2].min()), rotation, thrown.velocity, thrown.spin)


def obstacles(parameters: Parameters) -> tuple[Obstacle, ...]:
    """The slope."""
    return (slope(distance_of(parameters), angle_of(parameters)),)


def situation(rest: Mesh, parameters: Parameters) -> Situation:
    """The body above the slope."""
    flight = flight_over(rest.points, parameters)
    if flight.height < 0.0:
        raise InputError(f"distance: expected a body above the floor, got one {-flight.height:.2g} m below it")
    if flight.height > HIGHEST:
        raise InputError(f"distance: expected at most {HIGHEST:g} m above the floor, got {flight.height:.3g}")
    return beginning_outside(rest, flight, obstacles(parameters), "slope")


LOAD = Load(
    name="slope",
    title="Put it on a slope",
    happened="put on a slope",
    parameters=(
        Parameter("angle", "deg", 10.0, 40.0, 30.0, description="of the slope above the horizontal; it falls along x"),
        DISTANCE,
        Parameter("height", "m", 0.005, 0.1, 0.01, description="of the body's lowest point above the slope"),
        *PARAMETERS[1:],
        velocity("x", -1.0, 1.0, 0.0),
        SPINS[1],
    ),
    window=WINDOW,
    until=2.0,
    situation=situation,
    presets={
        "it slides": {"spin_y": 0.0},
        "a gentle slope": {"angle": 12.0, "spin_y": 0.0},
        "on its side, it rolls": {"turn_x": 90.0, "angle": 20.0},
        "head over heels": {"angle": 40.0, "height": 0.1, "turn_y": 60.0, "spin_y": 10.0},
        "up the slope, and back": {"angle": 25.0, "velocity_x": -1.0, "spin_y": 0.0},
    },
    notes=("The body begins just above the slope, without stress, turned from how it would lie there.",),
    obstacles=obstacles,
)
