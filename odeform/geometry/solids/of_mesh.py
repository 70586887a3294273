"""The inside of any mesh: open, self-intersecting, non-manifold, in parts, or a soup of triangles.

What is inside follows from the generalised winding number, which closes holes by itself (Jacobson et al. 2013, "Robust
inside-outside segmentation"; Barill et al. 2018, "Fast winding numbers for soups and clouds").
"""

from typing import Any

import igl
import numpy as np
import trimesh
from jaxtyping import Bool
from scipy import ndimage

from odeform.errors import InputError
from odeform.geometry.solids.cleaning import clean_mesh, oriented
from odeform.geometry.solids.of_points import enclosed_by_points
from odeform.geometry.solids.sampled import Enclosed, grid_around
from odeform.types import Floats, Ints, Mesh, PointCloud, Points

__all__ = ["enclosed_by_mesh"]

OPEN = 0.7  # sum of the area vectors, relative to the area: 0 if closed, 0.5 for half of a sphere, 1 for a flat sheet
INSIDE = 0.5  # winding number from which on a point is inside
NEAR = 3  # cells around the surface in which distances are exact
LOOSE, MANY = 0.1, 50  # parts for each face, and parts: from there on a mesh is a soup of triangles
TURNED = 0.7  # of what a soup outlines: less within the winding number's inside, and its triangles look every way
SAMPLES = 8.0  # points for each square of a cell's side, which find the cells at the surface


def enclosed_by_mesh(mesh: Mesh) -> Enclosed:
    """The inside of a mesh, in its units and axes. Raises `InputError` for one that is flat or far from closed."""
    points, faces, notes = clean_mesh(mesh)
    faces, turned = oriented(points, faces)
    corners = points[faces]
    areas = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = float(np.linalg.norm(areas, axis=1).sum())
    if float(np.linalg.norm(areas.sum(axis=0))) > OPEN * area:
        raise InputError("the mesh encloses no volume: it is open")
    grid = grid_around(points)
    at = grid.corners
    inside = (np.asarray(igl.fast_winding_number(points, faces, at)) > INSIDE).reshape(grid.values.shape)
    count = int(np.ceil(SAMPLES * area / grid.cell**2))
    samples = _samples(points, faces, count)
    beside = np.zeros(inside.shape, dtype=bool)
    beside[tuple(grid.indices(samples).T)] = True
    if _looks_every_way(faces, inside, beside):
        found = enclosed_by_points(PointCloud(samples))
        return Enclosed(found.distance, (*notes, "its triangles look every way, and count as points", *found.notes))
    near: Any = ndimage.binary_dilation(beside, iterations=NEAR)
    cells = grid.edge_distance(inside)
    exact = np.sqrt(np.asarray(igl.point_mesh_squared_distance(at[near.ravel()], points, faces)[0]))
    # a surface within the solid, where parts overlap, is none
    cells[near] = np.where(cells[near] < (NEAR + 1) * grid.cell, exact, cells[near])
    return Enclosed(grid.with_values(np.where(inside, -cells, cells)), (*notes, *turned))


def _looks_every_way(faces: Ints, inside: Bool[np.ndarray, "x y z"], beside: Bool[np.ndarray, "x y z"]) -> bool:
    """Whether a mesh is a soup whose triangles do not agree on what is inside; `beside` are cells at its surface."""
    parts = np.unique(np.asarray(igl.vertex_components(faces))[faces[:, 0]])
    if len(parts) < max(LOOSE * len(faces), MANY):
        return False
    thick = np.asarray(ndimage.binary_dilation(beside))
    filled = np.asarray(ndimage.binary_erosion(ndimage.binary_fill_holes(thick)))
    return int((inside & filled).sum()) < TURNED * int(filled.sum())


def _samples(points: Points, faces: Ints, count: int) -> Floats:
    found = trimesh.sample.sample_surface(trimesh.Trimesh(points, faces, process=False), count, seed=0)[0]
    return np.asarray(found)
