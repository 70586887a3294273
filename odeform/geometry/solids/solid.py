"""A closed solid of tetrahedra inside of any shape, and what had to be changed for it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import ndimage
from scipy.spatial import KDTree

from odeform.errors import InputError, counted
from odeform.geometry.solids.coarsening import Coarsening
from odeform.geometry.solids.lattice import cubic_lattice
from odeform.geometry.solids.of_mesh import enclosed_by_mesh
from odeform.geometry.solids.of_points import enclosed_by_points
from odeform.geometry.solids.sampled import Enclosed, Sampled
from odeform.geometry.solids.stuffing import stuff
from odeform.geometry.solids.tetrahedra import edges_of, largest_part, outer_first, pulled_apart, volumes
from odeform.types import Faces, Geometry, Ints, Mesh, Points

__all__ = ["Changes", "SolidMesh", "solid_inside"]

NODES = 1700  # of a solid, about: what a simulation can bear
FINE = 8000  # nodes at first
ROUNDS, CLOSE = 3, 0.2  # searches for the spacing of so many nodes; relative difference that is close enough
DENSITY = 5.5  # nodes within a spacing's cube, at first
FITS = 2  # times that the surface is moved onto that of the shape, and tetrahedra are made better
OUTWARD = 0.5  # spacings by which the surface is out meanwhile: a lattice loses walls that are thinner than a spacing
MOVED = 0.01  # of the longest extent, from which on a point of the surface counts as moved
PART = 0.1  # fraction of the volume of a second body that is not dropped any more
HOLLOW = 0.005  # fraction of the box's volume below which nothing is enclosed


@dataclass(frozen=True)
class Changes:
    """What a solid has that its shape does not have."""

    volume: float
    """Volume of the solid, relative to what the shape encloses."""
    thickened: float
    """Fraction of the surface where walls are thicker than those of the shape."""
    added: float
    """By how much there, as a fraction of the longest extent: the 95 % quantile, on each side."""
    lost: float
    """Fraction of the shape's inside that is too thin to be in the solid."""
    notes: tuple[str, ...] = ()
    """What else was done, in parts of a sentence."""

    def describe(self, size: float) -> str:
        """One line, for a body whose longest extent is `size` m."""
        said = list(self.notes)
        if self.thickened > 0.0:
            added, part = 2e3 * size * self.added, 100.0 * self.thickened
            said.append(f"thin walls are up to {added:.1f} mm thicker ({part:.0f} % of the surface)")
        if self.lost > 0.0:
            said.append(f"the thinnest parts are left out ({100.0 * self.lost:.1f} % of the volume)")
        return "; ".join([*said, f"volume {100.0 * (self.volume - 1.0):+.1f} %"])


@dataclass(frozen=True, eq=False)
class SolidMesh:
    """A solid of N nodes, of which the first S are on its surface, in the units and axes of a shape."""

    points: Points
    elements: Ints
    """(M, 4) tetrahedra."""
    faces: Faces
    """(F, 3) triangles of the surface, outward: indices below S."""
    changes: Changes


def solid_inside(geometry: Geometry, nodes: int = NODES) -> SolidMesh:
    """The solid of about so many nodes that a mesh bounds, or that points or splats outline. It takes one to three
    seconds.

    Raises `InputError` where nothing is enclosed, or several bodies are.
    """
    found = _one_body(enclosed_by_mesh(geometry) if isinstance(geometry, Mesh) else enclosed_by_points(geometry))
    distance = found.distance
    spacing, points, elements = _fine(distance)
    out = distance.with_values(distance.values - OUTWARD * spacing)
    solid = Coarsening(points, elements, out)
    solid.collapse(nodes)
    solid.improve()
    for _ in range(FITS):
        solid.project(distance)
        solid.improve()
    points, elements, faces = outer_first(solid.points, solid.elements)
    return SolidMesh(points, elements, faces, _changes(points, elements, faces, found))


def _changes(points: Points, elements: Ints, faces: Faces, found: Enclosed) -> Changes:
    distance, size = found.distance, float(np.ptp(points, axis=0).max())
    middles = points[faces].mean(axis=1)
    sides = points[faces[:, 1:]] - points[faces[:, :1]]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    away = distance(middles) / size
    thick = away > MOVED
    added = float(np.quantile(away[thick], 0.95)) if thick.any() else 0.0
    inside = distance.corners[distance.values.ravel() < 0.0]
    near = KDTree(np.concatenate([points, points[elements].mean(axis=1)])).query(inside)[0]
    edges = edges_of(elements)
    longest = np.quantile(np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1), 0.95)
    return Changes(
        float(volumes(points, elements).sum()) / distance.volume,
        float(areas[thick].sum() / areas.sum()),
        added,
        float((near > longest).mean()),
        found.notes,
    )


def _one_body(found: Enclosed) -> Enclosed:
    """Without what is much smaller than the largest body. `InputError` if another one is not."""
    distance = found.distance
    # walls thinner than a cell hold together what they join
    found_parts: Any = ndimage.label(distance.values < 0.5 * distance.cell, np.ones((3, 3, 3)))
    label, count = found_parts
    inside = distance.values < 0.0
    sizes = np.bincount(label[inside], minlength=count + 1)[1:]
    if not inside.any():
        raise InputError("the shape encloses no volume: it is open or flat")
    large = int((sizes > PART * sizes.max()).sum())
    if large > 1:
        raise InputError(f"the shape holds {large} separate bodies: expected one")
    kept = label == 1 + int(sizes.argmax())
    if sizes.max() < HOLLOW * np.prod(np.ptp(np.argwhere(kept), axis=0) + 1):
        raise InputError("the shape encloses no volume: it is open or flat")
    values = np.where(kept | (label == 0), distance.values, distance.cell)
    dropped = int((sizes > 0).sum()) - 1
    notes = (f"{counted(dropped, 'smaller part')} left out",) if dropped else ()
    return Enclosed(distance.with_values(values), (*found.notes, *notes))


def _fine(distance: Sampled) -> tuple[float, Points, Ints]:
    """The spacing of a lattice for about `FINE` nodes, and the solid that it makes, too large by `OUTWARD` spacings."""
    spacing = (distance.volume / FINE * DENSITY) ** (1.0 / 3.0)
    points, elements = _stuffed(distance, spacing)
    for _ in range(ROUNDS):
        ratio = len(np.unique(elements)) / FINE
        if abs(ratio - 1.0) < CLOSE:
            break
        spacing *= ratio**0.4
        points, elements = _stuffed(distance, spacing)
    return spacing, points, elements


def _stuffed(distance: Sampled, spacing: float) -> tuple[Points, Ints]:
    out = distance.with_values(distance.values - OUTWARD * spacing)
    box = np.argwhere(out.values < 0.0)
    low, high = (out.origin + out.cell * end for end in (box.min(axis=0), box.max(axis=0)))
    points, elements = stuff(out, *cubic_lattice(low - spacing, high + spacing, spacing))
    return pulled_apart(points, largest_part(points, elements))
