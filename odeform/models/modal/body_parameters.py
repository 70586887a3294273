"""Mass and stiffness of a body as parameters of its motion."""

from dataclasses import replace

from odeform.schema import Schema
from odeform.simulation.objects.soft_object import SoftObject

__all__ = ["MASS", "YOUNG", "schema_of"]

MASS, YOUNG = "mass", "young"
RANGE = 2.0  # factor by which they may be changed: from there on a soft object may collapse under its weight
LASTS = 7.0  # windows after the trained one: in 1.5 s all objects come to rest


def schema_of(item: SoftObject, schema: Schema) -> Schema:
    """The schema of one object: mass and Young's modulus from half to twice its own, if it has them, and as much time
    as it needs to come to rest."""
    own = {MASS: item.mass, YOUNG: 1e-3 * item.material.young}
    parameters = tuple(
        replace(p, low=own[p.name] / RANGE, high=own[p.name] * RANGE, default=own[p.name]) if p.name in own else p
        for p in schema.parameters
    )
    return replace(schema, parameters=parameters, window=replace(schema.window, reach=LASTS))
