"""Load `throw`: a body leaves the hand above the floor with a velocity and a spin."""

import numpy as np

from odeform.errors import InputError
from odeform.loads.arrow import Arrow
from odeform.loads.drop import PARAMETERS, WINDOW, height_of, turn_of
from odeform.loads.load import Load
from odeform.loads.situation import Flight, Situation
from odeform.schema import Parameter, Parameters
from odeform.types import Mesh, Vector

__all__ = ["LOAD", "SPINS", "arrows", "flight_of", "velocity"]

FASTEST, MOST_SPIN = 20.0, 200.0  # m/s and rad/s
SHOWN = 0.06  # s of the way that the arrow of the velocity is long


def velocity(axis: str, low: float, high: float, default: float) -> Parameter:
    """The slider of one component of the velocity."""
    return Parameter(
        f"velocity_{axis}", "m/s", low, high, default, description=f"velocity along {axis}, of the centre of mass"
    )


def _spin(axis: str, default: float) -> Parameter:
    return Parameter(f"spin_{axis}", "rad/s", -10.0, 10.0, default, description=f"speed of rotation about {axis}")


SPINS = (_spin("x", 0.0), _spin("y", 4.0), _spin("z", 0.0))


def _vector(parameters: Parameters, name: str, unit: str, most: float) -> Vector:
    vector = np.array([float(parameters[f"{name}_{axis}"]) for axis in "xyz"])
    if not np.linalg.norm(vector) <= most:
        raise InputError(f"{name}: expected at most {most:g} {unit}, got {np.linalg.norm(vector):.3g}")
    return vector


def flight_of(parameters: Parameters) -> Flight:
    """A body in the air that moves and turns."""
    speed = _vector(parameters, "velocity", "m/s", FASTEST)
    spin = _vector(parameters, "spin", "rad/s", MOST_SPIN)
    return Flight(height_of(parameters), turn_of(parameters), speed, spin)


def situation(rest: Mesh, parameters: Parameters) -> Situation:
    """The body in the air, moving and turning."""
    return Situation(flight_of(parameters))


def arrows(start: Mesh, parameters: Parameters) -> tuple[Arrow, ...]:
    """The velocity, from the middle of the body."""
    vector = _vector(parameters, "velocity", "m/s", FASTEST)
    speed = float(np.linalg.norm(vector))
    if speed == 0.0:
        return ()
    middle = 0.5 * (start.points.min(axis=0) + start.points.max(axis=0)).astype(float)
    return (Arrow(middle, SHOWN * vector, f"{speed:.1f} m/s", 0.0, SHOWN, leaves=True),)


LOAD = Load(
    name="throw",
    title="Throw it",
    happened="thrown",
    parameters=(
        *PARAMETERS,
        velocity("x", -1.5, 1.5, 1.0),
        velocity("y", -1.5, 1.5, 0.0),
        velocity("z", -0.5, 1.5, 0.0),
        *SPINS,
    ),
    window=WINDOW,
    until=2.0,
    situation=situation,
    presets={
        "thrown forward": {},
        "a somersault": {"velocity_x": 1.2, "velocity_z": 1.2, "spin_y": 9.0},
        "sliding in, flat": {"height": 0.05, "velocity_x": 1.5, "spin_y": 0.0},
        "spinning top": {"velocity_x": 0.0, "spin_y": 0.0, "spin_z": 10.0},
        "backspin": {"velocity_x": 1.5, "spin_y": -10.0},
    },
    notes=("The body begins in the air, without stress, and moves as a rigid body until it lands.",),
    arrows=arrows,
)
