"""Load `meet`: a body is thrown at a twin of itself that stands on the floor."""

import math

import numpy as np

from odeform.errors import InputError
from odeform.geometry.rigid import rotation_from_vector
from odeform.loads.drop import PARAMETERS, WINDOW
from odeform.loads.load import Load
from odeform.loads.situation import TOUCH, Situation, Twin
from odeform.loads.throw import SPINS, arrows, flight_of, velocity
from odeform.schema import Parameter, Parameters
from odeform.types import Mesh

__all__ = ["LOAD"]

FARTHEST = 100.0  # m


def twin_of(parameters: Parameters) -> Twin:
    """Where the other one stands; `InputError` for a place that no throw reaches, and for what is no angle."""
    place = np.array([float(parameters[name]) for name in ("distance", "beside")] + [0.0])
    if not np.linalg.norm(place) <= FARTHEST:
        raise InputError(f"distance, beside: expected at most {FARTHEST:g} m, got {place[0]:g} and {place[1]:g}")
    turn = math.radians(float(parameters["other_turn"]))
    if not math.isfinite(turn):
        raise InputError(f"other_turn: expected a finite angle in degrees, got {parameters['other_turn']}")
    return Twin(place, rotation_from_vector(np.array([0.0, 0.0, turn])))


def situation(rest: Mesh, parameters: Parameters) -> Situation:
    """The body in the air, on its way to the other one."""
    from odeform.geometry.solids.overlap import overlap  # it takes a moment to import, and other loads need none

    flight, twin = flight_of(parameters), twin_of(parameters)
    middle = rest.points.mean(axis=0, dtype=float)
    thrown, other = flight.placed(rest.points), twin.placed(rest.points, middle)
    inside = overlap(Mesh(thrown, rest.faces), Mesh(other, rest.faces))
    if inside > TOUCH:
        raise InputError(f"distance: expected a body that begins outside the other one, got {inside:.2g} m inside it")
    return Situation(flight, twin=twin)


LOAD = Load(
    name="meet",
    title="Throw it at another",
    happened="thrown at another",
    parameters=(
        Parameter("distance", "m", 0.35, 0.6, 0.55, description="from the body's middle to the other's, along x"),
        Parameter("beside", "m", -0.06, 0.06, 0.0, description="from the body's middle to the other's, along y"),
        Parameter("other_turn", "deg", -180.0, 180.0, 0.0, description="turn of the other one about z"),
        *PARAMETERS,
        velocity("x", 1.5, 3.0, 2.5),
        velocity("y", -0.2, 0.2, 0.0),
        velocity("z", -0.5, 1.5, 0.5),
        *SPINS,
    ),
    window=WINDOW,
    until=2.0,
    situation=situation,
    presets={
        "head on": {"height": 0.1, "velocity_x": 3.0, "velocity_z": 0.3, "spin_y": 0.0},
        "from above": {"distance": 0.4, "height": 0.4, "velocity_x": 1.5, "velocity_z": 1.5},
        "a glancing blow": {"beside": 0.06, "height": 0.1, "velocity_x": 3.0, "velocity_z": 0.3, "spin_y": 0.0},
        "spinning into it": {"height": 0.1, "velocity_x": 3.0, "spin_y": 0.0, "spin_z": 10.0},
        "one beside the other": {"other_turn": 90.0, "height": 0.1, "velocity_x": 2.0, "velocity_z": 0.5},
    },
    notes=(
        "The body begins in the air, without stress, and is thrown at another one like it, which stands on the floor. "
        "Where they touch, each gives way as it does on the floor.",
    ),
    arrows=arrows,
    pairs=True,
)
