"""Meshes without seams, doubles and specks, whose faces look outward."""

import igl
import numpy as np
import trimesh

from odeform.errors import InputError, counted
from odeform.geometry.solids.tetrahedra import keys_of
from odeform.types import Bools, Floats, Ints, Mesh, Points

__all__ = ["clean_mesh", "oriented"]

SPECK = 0.02  # extent of a part, relative to the whole, below which it is dropped
FLAT = 1e-4  # extent across, relative to the longest, below which a mesh encloses nothing
ROUNDED = 1e-9  # of the cube of the longest extent: volumes below it are rounding errors
INWARD = "its faces look inward, as those of a room do, and were turned: what they enclose was filled"
SEAM = 1e-6  # of the longest extent, within which vertices are one
MOST, FINE = 150_000, 128  # faces; of more, vertices are merged within the longest extent / FINE


def clean_mesh(mesh: Mesh) -> tuple[Points, Ints, tuple[str, ...]]:
    """Vertices (N, 3), faces (F, 3), and what was done, in parts of a sentence.

    Raises `InputError` for a mesh without an extent in each direction.
    """
    points, faces = np.asarray(mesh.points, dtype=float), np.asarray(mesh.faces, dtype=np.int64)
    if len(faces) < 4:
        raise InputError(f"expected a mesh of at least 4 triangles, got {len(faces)}")
    if not np.isfinite(points).all():
        raise InputError("the mesh has vertices that are not finite")
    size = float(np.ptp(points, axis=0).max())
    if not np.ptp(points, axis=0).min() > FLAT * size:
        raise InputError("the mesh encloses no volume: it is flat")
    many = len(faces) > MOST
    points, faces = _merged(points, faces, size / FINE if many else SEAM * size)
    # merged vertices tear a mesh here and there
    notes = [f"{len(mesh.faces):,} triangles were reduced to {len(faces):,}"] if many else _holes(points, faces, size)
    labels = np.asarray(igl.vertex_components(faces))[faces[:, 0]]
    low, high = _boxes(points, faces, labels)
    large = (high - low).max(axis=1) > SPECK * size
    if specks := int((~large[np.unique(labels)]).sum()):
        notes.append(f"{counted(specks, 'loose speck')} of less than {100 * SPECK:g} % of its size left out")
    return points, faces[large[labels]], tuple(notes)


def _merged(points: Floats, faces: Ints, width: float) -> tuple[Floats, Ints]:
    """Vertices within cells of that `width` become one; faces without an area, and doubles, are left out."""
    cell = np.round((points - points.min(axis=0)) / width).astype(np.int64)
    shape = cell.max(axis=0) + 1
    _, first, label = np.unique(np.ravel_multi_index(tuple(cell.T), shape), return_index=True, return_inverse=True)
    faces = label.ravel()[faces]
    faces = faces[(np.diff(np.sort(faces, axis=1), axis=1) > 0).all(axis=1)]
    _, kept = np.unique(keys_of(faces), return_index=True)
    return points[first], faces[np.sort(kept)]


def _holes(points: Points, faces: Ints, size: float) -> list[str]:
    """Says how many rims there are, and how wide the widest is."""
    ends = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    _, first, count = np.unique(keys_of(ends), return_index=True, return_counts=True)
    rim = ends[first[count == 1]]
    if not len(rim):
        return []
    used, local = np.unique(rim, return_inverse=True)
    label = trimesh.graph.connected_component_labels(local.reshape(-1, 2), node_count=len(used))
    widest = max(float(np.ptp(points[used[label == one]], axis=0).max()) for one in range(label.max() + 1))
    return [f"{counted(int(label.max()) + 1, 'hole')} closed, the widest {100.0 * widest / size:.0f} % of its size"]


def oriented(points: Points, faces: Ints) -> tuple[Ints, tuple[str, ...]]:
    """Turns faces (F, 3) so that they look outward, and says what was done.

    Parts that look inward within another are cavities, and stay, and so do those that are flat.
    """
    ends = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    directed = ends[:, 0] * len(points) + ends[:, 1]
    mixed = len(np.unique(directed)) < len(directed)
    if mixed:
        found, label = igl.bfs_orient(faces)
        faces, label = np.ascontiguousarray(found), np.asarray(label)
    else:
        label = np.asarray(igl.vertex_components(faces))[faces[:, 0]]
    corners = points[faces] - points.mean(axis=0)
    parts = int(label.max()) + 1
    centre = np.stack([np.bincount(label, corners[..., i].mean(axis=1), parts) for i in range(3)], axis=1)
    corners = corners - (centre / np.maximum(np.bincount(label, minlength=parts), 1)[:, None])[label, None]
    signed = np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    volume = np.bincount(label, signed, parts).astype(float)
    inward = volume < -ROUNDED * float(np.ptp(points, axis=0).max()) ** 3
    if not mixed and not inward.all():
        inward &= ~_within_another(points, faces, label, volume)
    turned = inward[label]
    faces = np.where(turned[:, None], faces[:, ::-1], faces)
    if mixed:
        return faces, ("faces that look inward were turned",)
    return faces, (INWARD,) if inward.any() else ()


def _within_another(points: Points, faces: Ints, label: Ints, volume: Floats) -> Bools:
    """(P,) which parts lie within the box of one that looks outward."""
    low, high = _boxes(points, faces, label)
    outward = np.flatnonzero(volume > 0.0)
    within = (low[:, None] >= low[outward]).all(axis=2) & (high[:, None] <= high[outward]).all(axis=2)
    return np.asarray(within.sum(axis=1) > 0)


def _boxes(points: Points, faces: Ints, label: Ints) -> tuple[Floats, Floats]:
    """(P, 3) the lowest and the highest coordinates of the parts that faces (F, 3) belong to, by `label` (F,)."""
    parts = int(label.max()) + 1
    low, high = np.full((parts, 3), np.inf), np.full((parts, 3), -np.inf)
    for corner in range(3):
        np.minimum.at(low, label, points[faces[:, corner]])
        np.maximum.at(high, label, points[faces[:, corner]])
    return low, high
