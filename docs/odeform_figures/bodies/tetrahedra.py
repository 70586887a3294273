"""Tetrahedra of solids that are given by a surface, by fTetWild.

Hu et al. 2020, "Fast tetrahedral meshing in the wild".
"""

import contextlib
import tempfile
from importlib import import_module
from typing import Any

import numpy as np
from scipy.spatial import KDTree

from odeform.geometry.solids.tetrahedra import outer_first, outward
from odeform.simulation.errors import SimulationError
from odeform.types import Faces, Floats, Ints, Mesh, Points

__all__ = ["CUBE", "small_solid", "tetrahedralise"]

ENVELOPE = 5e-4  # largest distance of the new surface from the old one, relative to the diagonal of the bounding box
GROWTH = 8.0  # metres by which the edges inside lengthen for each metre of depth
CUBE = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])
"""Six tetrahedra of a cube; bit 2, 1 and 0 of a corner are its steps along x, y and z."""

NODES = 1500  # at most: the cost of a simulation
FLAT = 1e-3  # quality below which MuJoCo's solver does not converge
FACTORS = (1.4, 2.0, 2.4, 3.0)  # from the edges of a surface to what fTetWild is asked for: it makes them shorter


def small_solid(surface: Mesh, factors: tuple[float, ...] = FACTORS) -> tuple[Points, Ints, Faces]:
    """`tetrahedralise`, with the first multiple (`factors`) of the surface's edges that needs at most `NODES` nodes.

    Returns (N, 3) m, (M, 4) and (F, 3). Raises `SimulationError` if none does.
    """
    corners = surface.points[surface.faces]
    edge = float(np.median(np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)))
    meshed = (tetrahedralise(surface, factor * edge) for factor in factors)
    small = next((found for found in meshed if len(found[0]) <= NODES and _quality(found[0], found[1]) > FLAT), None)
    if small is None:
        raise SimulationError(f"the solid needs more than {NODES} nodes, or has tetrahedra that are too flat")
    return small


def tetrahedralise(surface: Mesh, edge: float) -> tuple[Points, Ints, Faces]:
    """Nodes (N, 3) m, tetrahedra (M, 4) and outer faces (F, 3) of the solid inside `surface`; outer nodes come first.

    Edges are about `edge` metres long at the surface and longer inside.
    """
    points = np.array(surface.points, dtype=float, order="C")
    nodes, cells, lengths = _lengths(points, edge)
    mesher: Any = import_module("pytetwild")  # it takes a second

    # fTetWild leaves a file behind in the working directory
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        nodes, elements = mesher.tetrahedralize(
            points,
            np.array(surface.faces, dtype=np.int32, order="C"),
            edge_length_abs=float(edge),
            epsilon=ENVELOPE,
            num_threads=1,
            bg_vertices=nodes,
            bg_tets=cells,
            bg_values=lengths,
        )[:2]
    points = np.asarray(nodes, dtype=float)
    return outer_first(points, outward(points, np.asarray(elements, dtype=np.int64)))


def _quality(points: Points, elements: Ints) -> float:
    """The least volume of a tetrahedron, relative to the cube of its longest edge from one corner; 0.12 if regular."""
    sides = points[elements[:, 1:]] - points[elements[:, :1]]
    return float((np.linalg.det(sides) / 6.0 / np.linalg.norm(sides, axis=2).max(axis=1) ** 3).min())


def _lengths(points: Points, edge: float) -> tuple[Floats, Ints, Floats]:
    """A background mesh around `points`, with the edge length that is wanted at each of its nodes."""
    spacing = 2.0 * edge
    low = points.min(axis=0) - spacing
    shape = np.ceil((points.max(axis=0) + spacing - low) / spacing).astype(int) + 1
    index = np.arange(np.prod(shape)).reshape(shape)
    nodes = low + spacing * np.stack(np.unravel_index(index.ravel(), shape), axis=-1)
    steps = [slice(None, -1), slice(1, None)]
    corners = np.stack([index[steps[c >> 2], steps[c >> 1 & 1], steps[c & 1]].ravel() for c in range(8)], axis=-1)
    depth = np.maximum(KDTree(points).query(nodes)[0] - 0.5 * edge, 0.0)
    cells = np.ascontiguousarray(corners[:, CUBE].reshape(-1, 4), dtype=np.int32)
    return np.ascontiguousarray(nodes), cells, edge + GROWTH * depth
