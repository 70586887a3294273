"""Closed surfaces of untrained meshes: scans, open, self-intersecting, non-manifold, in parts or with texture seams.

fTetWild (Hu et al. 2020) needs none of these defects mended: it fills what the winding number calls inside.
"""

import contextlib
import tempfile

import numpy as np
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from odeform.errors import InputError
from odeform.simulation.objects.libraries import pytetwild
from odeform.simulation.objects.remesh import remesh
from odeform.simulation.objects.tetrahedra import SIDES, boundary, inside_out
from odeform.types import Floats, Ints, Mesh, Points

__all__ = ["even_surface", "repaired"]

SPECK = 0.02  # extent of a part, relative to the whole, below which it is dropped
PART = 0.1  # fraction of the volume of a second body that is not dropped any more
OPEN = 0.7  # sum of the area vectors, relative to the area: 0 if closed, 0.5 for half of a sphere, 1 for a flat sheet
HOLLOW = 0.01  # fraction of the convex hull's volume below which a mesh encloses nothing
ATTEMPTS = 6  # at a closed surface, where thin parts make that hard
FINE = 9000  # vertices before remeshing


def repaired(mesh: Mesh) -> Mesh:
    """Makes a fine closed surface around the solid that `mesh` bounds, in its units and axes.

    Raises `InputError` for meshes that enclose no volume, or several bodies.
    """
    points, faces = _clean(mesh)
    low, size = points.min(axis=0), float(np.ptp(points, axis=0).max())
    nodes, elements = _filled((points - low) / size, faces)
    kept = _largest_part(nodes, elements)
    sides = boundary(kept)
    used, position = np.unique(sides, return_inverse=True)
    surface = trimesh.Trimesh(nodes[used], position.reshape(-1, 3), process=False)
    if surface.volume < HOLLOW * surface.convex_hull.volume:
        raise InputError("the mesh encloses no volume: it is open or flat")
    while len(surface.vertices) < FINE:
        surface = surface.subdivide()
    return Mesh(np.asarray(surface.vertices) * size + low, np.asarray(surface.faces, dtype=np.int32))


def even_surface(fine: Mesh, count: int) -> Mesh:
    """Spreads about `count` even vertices on a fine surface.

    It is the first of some attempts that is closed; else the last, whose defects fTetWild mends.
    """
    even = fine
    for seed in range(ATTEMPTS):
        even = remesh(fine, count, seed)
        if trimesh.Trimesh(even.points, even.faces, process=False).is_watertight:
            break
    return even


def _clean(mesh: Mesh) -> tuple[Points, Ints]:
    """Vertices and faces without seams, doubles and specks."""
    points = np.asarray(mesh.points, dtype=float)
    if len(mesh.faces) < 4:
        raise InputError(f"expected a mesh of at least 4 triangles, got {len(mesh.faces)}")
    if not np.isfinite(points).all():
        raise InputError("the mesh has vertices that are not finite")
    size = float(np.ptp(points, axis=0).max())
    if not np.ptp(points, axis=0).min() > 1e-4 * size:
        raise InputError("the mesh encloses no volume: it is flat")
    shape = trimesh.Trimesh((points - points.min(axis=0)) / size, mesh.faces, process=False)
    shape.merge_vertices(digits_vertex=6)
    shape.update_faces(shape.nondegenerate_faces() & shape.unique_faces())
    labels = trimesh.graph.connected_component_labels(_edge_pairs(shape.faces), node_count=len(shape.vertices))
    extents = np.array([np.ptp(shape.vertices[labels == label], axis=0).max() for label in range(labels.max() + 1)])
    kept = extents[labels[shape.faces[:, 0]]] > SPECK
    shape.update_faces(kept)
    # what fTetWild makes of a sheet differs from call to call
    if float(np.linalg.norm(shape.area_faces @ shape.face_normals)) > OPEN * shape.area:
        raise InputError("the mesh encloses no volume: it is open")
    return np.asarray(shape.vertices) * size + points.min(axis=0), np.asarray(shape.faces)


def _edge_pairs(faces: Ints) -> Ints:
    return np.concatenate([faces[:, :2], faces[:, 1:]])


def _filled(points: Points, faces: Ints) -> tuple[Floats, Ints]:
    """Nodes and tetrahedra of what the triangles enclose."""
    mesher = pytetwild()
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        try:
            nodes, elements = mesher.tetrahedralize(
                np.array(points, order="C"), np.array(faces, dtype=np.int32, order="C"), epsilon=2e-3, num_threads=1
            )[:2]
        except RuntimeError as error:
            raise InputError(f"the mesh cannot be filled with tetrahedra: {error}") from None
    if not len(elements):
        raise InputError("the mesh encloses no volume: it is open or flat")
    nodes, elements = np.asarray(nodes, dtype=float), np.asarray(elements, dtype=np.int64)
    inverted = inside_out(nodes, elements)
    elements[inverted] = elements[inverted][:, [0, 2, 1, 3]]
    return nodes, elements


def _largest_part(nodes: Floats, elements: Ints) -> Ints:
    """The tetrahedra of the largest body. Raises `InputError` if another one is not much smaller."""
    sides = np.sort(elements[:, SIDES].reshape(-1, 3), axis=1)
    _, side = np.unique(sides, axis=0, return_inverse=True)
    order = np.argsort(side.ravel(), kind="stable")
    owner = order // 4
    shared = np.flatnonzero(np.diff(side.ravel()[order]) == 0)
    links = coo_array((np.ones(len(shared)), (owner[shared], owner[shared + 1])), shape=(len(elements),) * 2)
    count, label = connected_components(links, directed=False)
    corners = nodes[elements]
    volumes = np.bincount(label, np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])), count)
    large = int((volumes > PART * volumes.max()).sum())
    if large > 1:
        raise InputError(f"the mesh holds {large} separate bodies: expected one")
    return elements[label == int(volumes.argmax())]
