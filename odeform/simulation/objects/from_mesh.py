"""Soft objects of shapes of the user's own: meshes, such as scans, points and splats."""

from dataclasses import dataclass

import numpy as np
import trimesh

from odeform.errors import InputError
from odeform.geometry.similarity import Similarity
from odeform.geometry.solids.solid import Changes, solid_inside
from odeform.geometry.upright import guess_up
from odeform.mechanics.standing import lying, sag, standing
from odeform.simulation.objects.canonical import UNITS, most_like, plausible_scale
from odeform.simulation.objects.materials import CHOICE, forces_on
from odeform.simulation.objects.soft_object import SoftMaterial, SoftObject, nodal_masses
from odeform.simulation.objects.thickness import median_thickness
from odeform.types import Geometry, Ints, Mesh, Points

__all__ = ["PlacedObject", "placed_object"]

SAMPLES = 1200  # points of the surface that are compared with the seven objects
SAGS = 0.1  # of its height, by which a body may give way under its weight


@dataclass(frozen=True, eq=False)
class PlacedObject:
    """A soft object, and how the shape that it was made of became it."""

    item: SoftObject
    """Its nodes are in metres."""
    transform: Similarity
    """Maps the shape to the nodes of `item` without stress."""
    like: str
    """The object whose orientation it has."""
    changes: Changes
    """What was done to make a solid of it."""
    material: str
    """What it is of, and why, as in "of foam"."""
    unit: str
    """Which unit its file was taken to be in, if not metres."""

    def describe(self) -> str:
        """Returns one line: the material, the unit, and what the solid has that the shape does not have."""
        size = float(np.ptp(self.item.settled, axis=0).max())
        return "; ".join(said for said in (f"of {self.material}", self.unit, self.changes.describe(size)) if said)


def placed_object(
    geometry: Geometry,
    name: str = "object",
    like: str | None = None,
    material: SoftMaterial | None = None,
    up: str | None = None,
    unit: float | None = None,
) -> PlacedObject:
    """Makes a solid inside of a shape, turned, and at rest on the floor.

    Args:
        geometry: In any unit and axes. See `odeform.geometry.solids.solid.solid_inside`.
        name: That of the object.
        like: The object whose orientation it gets; default: the most similar solid one.
        material: Default: the softest of `CHOICE` under which it stands.
        up: Axis of the shape that points up, as "+y"; default: what its file says, else y if it stands better on
            it, else z.
        unit: Metres of one unit of the shape; default: guessed, see `plausible_scale`.

    Raises `InputError` for a shape that encloses no volume, holds several bodies, or does not stand.
    """
    if unit is not None and not 0.0 < unit < np.inf:
        raise InputError(f"unit: expected a positive number of metres, got {unit}")
    solid = solid_inside(geometry)
    surface = Mesh(solid.points[: solid.faces.max() + 1], solid.faces)
    shape = trimesh.Trimesh(surface.points, surface.faces, process=False)
    even = np.asarray(trimesh.sample.sample_surface(shape, SAMPLES, seed=0)[0])
    like, rotation = most_like(even, like, up or geometry.up or guess_up(surface))
    extent = float(np.ptp(surface.points, axis=0).max())
    scale = plausible_scale(extent, like) if unit is None else unit
    turned = scale * (solid.points @ rotation.T)
    chosen = material or next(iter(CHOICE.values()))
    rotation = lying(turned, nodal_masses(turned, solid.elements, chosen)) @ rotation
    place = Similarity(scale, rotation, -scale * rotation @ even.mean(axis=0))
    points = place.points(solid.points)
    settled, used, said = _at_rest(points, solid.elements, material, name)
    thickness = median_thickness(Mesh(points[: solid.faces.max() + 1], solid.faces))
    mass = float(nodal_masses(points, solid.elements, used).sum())
    weakest, strongest = (float(f"{force:.2g}") for force in forces_on(used, thickness, mass))
    item = SoftObject(name, points, solid.elements, solid.faces, settled, used, (weakest, strongest), thickness)
    return PlacedObject(item, place, like, solid.changes, said, _unit(extent, scale, like) if unit is None else "")


def _at_rest(
    points: Points, elements: Ints, material: SoftMaterial | None, name: str
) -> tuple[Points, SoftMaterial, str]:
    """The nodes (N, 3) m at rest, the material, and its name with the reason."""
    choice = CHOICE if material is None else {"given": material}
    least = 0.0 if material else (1.0 - SAGS) * float(np.ptp(points[:, 2]))  # m of height, or another one is chosen
    weak = 0.0  # stiffness for its density of what it did not stand of
    for called, one in choice.items():
        masses = nodal_masses(points, elements, one)
        if material is None and one.young / one.density <= weak:
            continue
        rests, settled = material is not None or sag(points, elements, masses, one.young, one.poisson) < SAGS, points
        if rests:
            settled, rests = standing(points, elements, masses, one.young, one.poisson, least)
        if rests:
            shift = masses @ settled / masses.sum() * [1.0, 1.0, 0.0]
            return settled - shift, one, _described(one, "" if material else called)
        weak = max(weak, one.young / one.density)
    raise InputError(f"{name}: it does not stand: parts of it collapse under its weight, also of {list(choice)[-1]}")


def _unit(extent: float, scale: float, like: str) -> str:
    """Says which unit was taken, for a shape of that extent in its own."""
    if scale in UNITS:
        return "" if scale == 1.0 else f"its file is taken to be in {UNITS[scale]}"
    size = 100.0 * extent * scale
    return f"with an extent of {extent:.3g} it fits no usual unit, and was scaled to the {like}'s {size:.0f} cm"


def _described(material: SoftMaterial, chosen: str) -> str:
    figures = f"{1e-3 * material.young:g} kPa and {material.density:g} kg/m³"
    return f"{chosen} ({figures}), the softest material with which it stands" if chosen else figures
