"""Scenes in which a sphere pushes a body: their parameters are `object`, `contact_x` to `_z`, `force_x` to `_z`."""

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np

from odeform.geometry.contact import SurfacePoint, nearest_on
from odeform.geometry.push import TOWARDS, Push, default_contact, push_of
from odeform.schema import Parameters
from odeform.types import Mesh, Vector

__all__ = [
    "CONTACT",
    "FORCE",
    "MASS",
    "YOUNG",
    "Forces",
    "complete_push",
    "contact_parameters",
    "forces_there",
    "push_from",
    "vector_of",
    "weaker",
]

Forces: TypeAlias = tuple[float, float] | Callable[[SurfacePoint], tuple[float, float]]
"""The weakest and the strongest push in newton: the same everywhere on a body, or those at a contact."""

MIDDLING = 0.7  # from the weakest to the strongest force of an object: that of a push that is not given
CONTACT, FORCE = "contact", "force"
MASS, YOUNG = "mass", "young"
"""Names the parameters of the body in kg and kPa, where they are parameters; otherwise it has its own."""


def complete_push(given: Mapping[str, Any], rest: Mesh, forces: Forces) -> dict[str, Any]:
    """A contact and a force for those that are not given, on a body at rest.

    The contact is a visible point of its surface, on the
    side that a given force pushes from; the force is of middling strength, straight into the surface. What is given
    only in part, or is not a number, is left alone.
    """
    try:
        contact, force = (_given(given, name) for name in (CONTACT, FORCE))
    except (TypeError, ValueError):
        return dict(given)
    if contact is not None and force is not None:
        return dict(given)
    if contact is None:
        pushed = force is not None and force.any()
        at = default_contact(rest, -force if pushed else TOWARDS)  # pyright: ignore[reportOptionalOperand]
    else:
        at = nearest_on(rest, contact)
    weakest, strongest = forces_there(forces, at)
    push = Push(at, weakest + MIDDLING * (strongest - weakest))
    return {**contact_parameters(push), **given}


def forces_there(forces: Forces, contact: SurfacePoint) -> tuple[float, float]:
    """Newton, weakest and strongest at a contact."""
    return forces(contact) if callable(forces) else forces


def _given(given: Mapping[str, Any], name: str) -> Vector | None:
    """The vector of that name; None if no part of it is given. ValueError or TypeError if it is not three numbers."""
    parts = [given.get(f"{name}_{axis}") for axis in "xyz"]
    if all(part is None for part in parts):
        return None
    vector = np.array([float(part) for part in parts])  # pyright: ignore[reportArgumentType]
    if not np.isfinite(vector).all():
        raise ValueError(name)
    return vector


def vector_of(parameters: Parameters, name: str) -> Vector:
    """Computes (3,) the parameters NAME_x, NAME_y and NAME_z."""
    return np.array([float(parameters[f"{name}_{axis}"]) for axis in "xyz"])


def weaker(parameters: Parameters, times: float) -> dict[str, Any]:
    """Returns the same push with a force so many times weaker."""
    return {name: value / times if name.startswith(f"{FORCE}_") else value for name, value in parameters.items()}


def contact_parameters(push: Push) -> dict[str, float]:
    """The parameters of a scene that a push stands for."""
    both = ((CONTACT, push.contact.point), (FORCE, push.force))
    return {f"{name}_{axis}": float(x) for name, vector in both for axis, x in zip("xyz", vector, strict=True)}


def push_from(parameters: Parameters, rest: Mesh) -> Push:
    """The push that parameters describe, at the point of the body at rest that is nearest to their contact."""
    return push_of(nearest_on(rest, vector_of(parameters, CONTACT)), vector_of(parameters, FORCE))
