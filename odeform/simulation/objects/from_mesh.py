"""Soft objects of untrained meshes, such as scans."""

import contextlib
from dataclasses import dataclass

import numpy as np

from odeform.errors import InputError
from odeform.geometry.similarity import Similarity
from odeform.geometry.upright import guess_up
from odeform.simulation.errors import SimulationError
from odeform.simulation.objects.canonical import most_like, plausible_scale
from odeform.simulation.objects.materials import FORCES, MATERIALS
from odeform.simulation.objects.repair import even_surface, repaired
from odeform.simulation.objects.settling import settle
from odeform.simulation.objects.soft_object import SoftMaterial, SoftObject
from odeform.simulation.objects.tetrahedra import small_solid
from odeform.simulation.objects.thickness import median_thickness
from odeform.types import Faces, Ints, Mesh, Points

__all__ = ["PlacedObject", "placed_object"]

COUNTS = (1100, 800, 550)  # surface vertices to try: shapes with thin walls need more nodes than smooth ones
FACTORS = (2.0, 3.0)  # see `small_solid`


@dataclass(frozen=True, eq=False)
class PlacedObject:
    """A soft object, and how the mesh that it was made of became it."""

    item: SoftObject
    """Its nodes are in metres, at most 1,500 of them."""
    transform: Similarity
    """Maps the mesh to the nodes of `item` without stress."""
    like: str
    """The object whose orientation, material and forces it has."""


def placed_object(
    mesh: Mesh,
    name: str = "object",
    like: str | None = None,
    material: SoftMaterial | None = None,
    up: str | None = None,
    unit: float | None = None,
) -> PlacedObject:
    """Makes a solid of a closed or nearly closed surface, repaired, turned, and settled on the floor.

    Args:
        mesh: In any unit and axes. Defects are repaired: seams, holes, self-intersections, parts that overlap.
        name: That of the object.
        like: The object whose orientation, material and forces it gets; default: the most similar solid one.
        material: Instead of that of `like`.
        up: Axis of the mesh that points up, as "+y"; default: what its file says, else y if it stands better on
            it, else z.
        unit: Metres of one unit of the mesh; default: guessed, see `plausible_scale`.

    Needs the extra `objects`. Raises `InputError` for a mesh that encloses no volume, holds several bodies, or does not
    come to rest.
    """
    if unit is not None and not 0.0 < unit < np.inf:
        raise InputError(f"unit: expected a positive number of metres, got {unit}")
    fine = repaired(mesh)
    surface = even_surface(fine, COUNTS[0])
    like, rotation = most_like(surface.points, like, up or mesh.up or guess_up(surface))
    scale = plausible_scale(float(np.ptp(surface.points, axis=0).max()), like) if unit is None else unit
    place = Similarity(scale, rotation, -scale * rotation @ surface.points.mean(axis=0))
    turned = Mesh(place.points(fine.points), fine.faces)
    material = MATERIALS[like] if material is None else material
    try:
        points, elements, faces = _solid(turned)
        settled = settle(points, elements, material)
    except SimulationError as error:
        raise InputError(f"mesh {name}: it cannot be simulated: {error}") from None
    thickness = median_thickness(Mesh(points[: faces.max() + 1], faces))
    item = SoftObject(name, points, elements, faces, settled, material, FORCES[like], thickness)
    return PlacedObject(item, place, like)


def _solid(fine: Mesh) -> tuple[Points, Ints, Faces]:
    """Makes a solid with as many surface vertices as a small one can have."""
    for count in COUNTS[:-1]:
        with contextlib.suppress(SimulationError):
            return small_solid(even_surface(fine, count), FACTORS)
    return small_solid(even_surface(fine, COUNTS[-1]), FACTORS)
