"""Load `kick`: a short pulse on a patch of a body that rests on the floor."""

import numpy as np

from odeform.errors import InputError
from odeform.geometry.contact import SNAP, nearest_on
from odeform.loads.arrow import Arrow
from odeform.loads.load import Load
from odeform.loads.situation import Pulse, Situation
from odeform.schema import Parameter, Parameters, Window
from odeform.types import Mesh, Vector

__all__ = ["LOAD", "STRONGER"]

PULSE = 0.020  # s
RADIUS = 0.02  # m, of the patch
STRONGER = 3.0  # times the strongest push of a sphere, which lasts twice as long: the peak of the strongest kick
LENGTH = 0.4  # of the body's size: the arrow of that force on the strongest object


def _three(name: str, unit: str, ends: dict[str, tuple[float, float, float]], description: str) -> list[Parameter]:
    return [
        Parameter(f"{name}_{axis}", unit, low, high, default, description=f"{axis} of {description}")
        for axis, (low, high, default) in ends.items()
    ]


def vectors_of(parameters: Parameters) -> tuple[Vector, Vector]:
    """Where and how hard: (3,) m and (3,) N."""
    contact, force = (np.array([float(parameters[f"{name}_{a}"]) for a in "xyz"]) for name in ("contact", "force"))
    return contact, force


def situation(rest: Mesh, parameters: Parameters) -> Situation:
    """The body on the floor, kicked at a contact on its surface."""
    contact, force = vectors_of(parameters)
    place = nearest_on(rest, contact)
    if place.distance > SNAP:
        raise InputError(
            f"contact: expected a point within {1e3 * SNAP:g} mm of the surface, "
            f"got one {1e3 * place.distance:.1f} mm off it"
        )
    if float(place.normal @ force) > 1e-9:
        raise InputError("force: expected one that pushes into the surface at the contact, got one that pulls it")
    return Situation(pulse=Pulse(place, force, PULSE, RADIUS))


def arrows(start: Mesh, parameters: Parameters) -> tuple[Arrow, ...]:
    """The force, as an arrow that ends where it acts."""
    contact, force = vectors_of(parameters)
    strength, size = float(np.linalg.norm(force)), float(np.ptp(start.points, axis=0).max())
    if strength == 0.0:
        return ()
    vector = LENGTH * size * min(strength / (STRONGER * 25.0), 2.0) / strength * force
    return (Arrow(contact - vector, vector, f"{strength:.0f} N", 0.0, PULSE, rises=True),)


FORCE = STRONGER * 25.0

LOAD = Load(
    name="kick",
    title="Kick it",
    happened="kicked",
    parameters=(
        *_three(
            "contact",
            "m",
            {"x": (-0.32, 0.32, 0.038), "y": (-0.22, 0.22, 0.0), "z": (0.0, 0.45, 0.1)},
            "the point that is kicked",
        ),
        *_three(
            "force",
            "N",
            {"x": (-FORCE, FORCE, -24.0), "y": (-FORCE, FORCE, 0.0), "z": (-FORCE, FORCE, 0.0)},
            f"the peak of the force, which rises and falls within {1e3 * PULSE:.0f} ms",
        ),
    ),
    window=Window(0.0, 0.5, 100.0),
    until=2.0,
    situation=situation,
    notes=("The body rests on the floor. A pulse acts on a patch of its surface, without a body that would touch it.",),
    arrows=arrows,
    pulse=PULSE,
)
