"""Mass and stiffness of a body as parameters of its motion: mechanics takes them as they are, no data vary them."""

from collections.abc import Sequence
from dataclasses import replace

from odeform.schema import Parameter, Schema
from odeform.simulation.contacts import MASS, YOUNG
from odeform.simulation.objects.soft_object import SoftObject

__all__ = ["schema_of"]

RANGE = 2.0  # factor by which they may be changed: from there on a soft object may collapse under its weight
LASTS = 7.0  # windows after the trained one: in 1.5 s all objects come to rest


def schema_of(items: Sequence[SoftObject], schema: Schema) -> Schema:
    """The schema of one or more objects: with mass and Young's modulus, from half the smallest to twice the largest and
    by default those of the first, and with as much time as they need to come to rest."""
    masses, moduli = [item.mass for item in items], [1e-3 * item.material.young for item in items]
    added = (
        _parameter(MASS, "kg", masses, "mass of the body"),
        _parameter(YOUNG, "kPa", moduli, "Young's modulus of the body"),
    )
    known = tuple(p for p in schema.parameters if p.role != "body")
    return replace(schema, parameters=known + added, window=replace(schema.window, reach=LASTS))


def _parameter(name: str, unit: str, values: Sequence[float], description: str) -> Parameter:
    return Parameter(name, unit, min(values) / RANGE, max(values) * RANGE, values[0], "log", "body", description)
