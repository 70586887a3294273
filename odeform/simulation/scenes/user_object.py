"""Scenes of one body of a user's own shape: what happens to the seven objects happens to it."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.loads.registry import load_of_scene
from odeform.schema import Parameter, Parameters, Schema
from odeform.simulation.contacts import CONTACT, FORCE, Forces, complete_push
from odeform.simulation.objects.materials import forces_at
from odeform.simulation.objects.soft_object import SoftObject
from odeform.simulation.scene import Scene
from odeform.simulation.scenes.contact_force import drawn_on, simulate_object
from odeform.simulation.scenes.loaded import drawn_apart, forces_of, simulate_load
from odeform.simulation.scenes.registry import get_scene
from odeform.surroundings import Contacts
from odeform.types import MotionSequence

__all__ = ["COUNT", "scene_with"]

COUNT = 40  # sequences in a data set, unless another number is asked for
SLACK = 0.05  # of the size, by which ranges of contacts are wider than the body


def scene_with(name: str, item: SoftObject) -> Scene:
    """The scene `name` of soft objects, with `item` in place of the seven.

    Contacts and forces have the ranges of the body. `InputError` for a scene without objects.
    """
    known = get_scene(name)
    if not known.schema.objects:
        raise InputError(f"scene {name}: it has one body of its own; expected a scene of soft objects to push")
    load = load_of_scene(name)
    pushed = known.contacts is not None
    forces, there = (
        (item.forces, partial(forces_at, item)) if load is None else (forces_of(item), partial(forces_of, item))
    )

    def simulate(parameters: Parameters, **options: Any) -> MotionSequence:
        return (
            simulate_object(item, parameters, **options)
            if load is None
            else simulate_load(load, item, parameters, **options)
        )

    def draw(_: str, count: int, seed: int) -> list[dict[str, Any]]:
        return drawn_on(item, there, count, seed)

    def apart(_: str, count: int, seed: int) -> list[dict[str, Any]]:
        assert load is not None
        return drawn_apart(load, item.rest_mesh(), count, seed)

    sampler: Callable[..., Any] | None = draw if pushed else None
    if load is not None and load.pairs:
        sampler = apart
    contacts = None
    if known.contacts is not None:
        contacts = Contacts({item.name: forces}, known.contacts.pulse, known.contacts.radius)
    return replace(
        known,
        schema=_schema(known.schema, item, forces[1], there if pushed else None),
        simulate=simulate,
        rest_mesh=item.rest_mesh,
        count=COUNT,
        contacts=contacts,
        sampler=sampler,
    )


def _schema(schema: Schema, item: SoftObject, strongest: float, there: Forces | None) -> Schema:
    """The schema with one object; where a body is pushed, by up to `strongest` N, with contacts and forces of its
    own."""
    schema = replace(schema, objects=(item.name,))
    if there is None:
        return schema
    rest = item.rest_mesh()
    points = rest.points.astype(float)
    slack = SLACK * float(np.ptp(points, axis=0).max())
    low, high = points.min(axis=0) - slack, points.max(axis=0) + slack
    defaults = complete_push({}, rest, there)
    ranges = {f"{CONTACT}_{axis}": (low[i], high[i]) for i, axis in enumerate("xyz")}
    ranges |= {f"{FORCE}_{axis}": (-strongest, strongest) for axis in "xyz"}

    def ranged(parameter: Parameter) -> Parameter:
        if parameter.name not in ranges:
            return parameter
        first, last = (float(end) for end in ranges[parameter.name])
        return replace(parameter, low=first, high=last, default=float(defaults[parameter.name]))

    return replace(schema, parameters=tuple(ranged(p) for p in schema.parameters))
