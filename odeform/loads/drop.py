"""Load `drop`: a body is turned, held above the floor, and let go."""

import numpy as np

from odeform.errors import InputError
from odeform.geometry.rigid import rotation_from_vector
from odeform.loads.load import Load
from odeform.loads.situation import Flight, Situation
from odeform.schema import Parameter, Parameters, Window
from odeform.types import Mesh, Rotations

__all__ = ["LOAD", "PARAMETERS", "WINDOW", "height_of", "turn_of"]

HIGHEST = 100.0  # m


def _turn(axis: str) -> Parameter:
    return Parameter(
        f"turn_{axis}", "deg", -180.0, 180.0, 0.0, description=f"turn about {axis} at the start; x first, z last"
    )


PARAMETERS = (
    Parameter("height", "m", 0.05, 0.4, 0.25, description="of the body's lowest point above the floor"),
    _turn("x"),
    _turn("y"),
    _turn("z"),
)
WINDOW = Window(0.0, 0.8, 100.0)


def height_of(parameters: Parameters) -> float:
    """Metres; `InputError` for a body that would begin in the floor, or so high that air would matter."""
    height = float(parameters["height"])
    if not 0.0 <= height <= HIGHEST:
        raise InputError(f"height: expected 0 to {HIGHEST:g} m above the floor, got {height:g}")
    return height


def turn_of(parameters: Parameters) -> Rotations:
    """(3, 3): about x, then about y, then about z."""
    x, y, z = (
        rotation_from_vector(np.radians(float(parameters[f"turn_{axis}"])) * unit)
        for axis, unit in zip("xyz", np.eye(3), strict=True)
    )
    return z @ y @ x


def situation(rest: Mesh, parameters: Parameters) -> Situation:
    """The body in the air."""
    return Situation(flight=Flight(height_of(parameters), turn_of(parameters)))


LOAD = Load(
    name="drop",
    title="Drop it",
    happened="dropped",
    parameters=PARAMETERS,
    window=WINDOW,
    until=2.0,
    situation=situation,
    presets={
        "as it stands": {},
        "on its side": {"turn_x": 90.0},
        "upside down, from high up": {"turn_y": 180.0, "height": 0.4},
        "on an edge": {"turn_x": 40.0, "turn_y": 30.0, "height": 0.35},
        "a nudge": {"turn_x": 8.0, "height": 0.05},
    },
    notes=("The body begins at rest in the air, without stress, turned from how it rests on the floor.",),
)
