"""Polygons as triangles, also those that are not convex."""

import itertools

import numpy as np
from jaxtyping import Float

from odeform.types import Faces, Floats, Ints

__all__ = ["triangulated"]


def triangulated(points: Floats, corners: Ints, counts: Ints) -> tuple[Faces, Ints]:
    """Maps polygons to triangles, in the same order and orientation.

    Args:
        points: (N, 3) vertices.
        corners: (C,) vertices of the corners of all polygons, one polygon after the other.
        counts: (P,) how many corners each polygon has; those with fewer than three give no triangles.

    Returns:
        (F, 3) triangles as indices into `corners`, and (F,) the polygon of each.
    """
    if len(counts) and (counts == 3).all():
        return np.arange(3 * len(counts)).reshape(-1, 3), np.arange(len(counts))
    first = np.cumsum(counts) - counts
    room = np.maximum(counts - 2, 0)
    out = np.full((int(room.sum()), 3), -1, np.int64)
    place = np.cumsum(room) - room
    for count in np.unique(counts[counts >= 3]):
        chosen = np.flatnonzero(counts == count)
        ring = first[chosen, None] + np.arange(count)
        fan = _fan(int(count))
        out[place[chosen, None] + np.arange(count - 2)] = first[chosen, None, None] + fan
        if count == 3:
            continue
        shape = np.asarray(points, dtype=float)[corners[ring]]
        normals, reflex = _reflex(shape)
        if count == 4:
            other = chosen[reflex[:, 1] | reflex[:, 3]]
            out[place[other, None] + np.arange(2)] = first[other, None, None] + np.array([[1, 2, 3], [1, 3, 0]])
            continue
        for index in np.flatnonzero(reflex.any(axis=1)):
            ears = _ears(shape[index], normals[index])
            if ears is not None:
                start = place[chosen[index]]
                out[start : start + count - 2] = -1
                out[start : start + len(ears)] = first[chosen[index]] + ears
    kept = out[:, 0] >= 0
    return out[kept], np.repeat(np.arange(len(counts)), room)[kept]


def _fan(count: int) -> Faces:
    last = np.arange(2, count)
    return np.stack([np.zeros_like(last), last - 1, last], axis=1)


def _reflex(shape: Float[np.ndarray, "polygons corners 3"]) -> tuple[Floats, np.ndarray]:
    """(P, 3) normals by Newell's method, and (P, C) whether a polygon turns inwards at each corner."""
    shape = shape - shape[:, :1]
    following = np.roll(shape, -1, axis=1)
    normals = np.cross(shape, following).sum(axis=1)
    turns = np.cross(shape - np.roll(shape, 1, axis=1), following - shape)
    along = np.einsum("pci,pi->pc", turns, normals)
    # rounding turns straight corners a little
    return normals, along < -1e-9 * np.einsum("pi,pi->p", normals, normals)[:, None]


def _ears(shape: Floats, normal: Floats) -> Faces | None:
    """Triangles of one polygon by ear clipping in its plane; None where it has no area."""
    import mapbox_earcut

    length = np.linalg.norm(normal)
    if not 0.0 < length < np.inf:
        return None
    normal = normal / length
    side = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    side /= np.linalg.norm(side)
    flat = (shape - shape[0]) @ np.stack([side, np.cross(normal, side)], axis=1)
    ears = mapbox_earcut.triangulate_float64(np.ascontiguousarray(flat), np.array([len(flat)], np.uint32))
    faces = ears.reshape(-1, 3).astype(np.int64)
    a, b, c = flat[faces].swapaxes(0, 1)
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    faces[area < 0.0] = faces[area < 0.0][:, ::-1]
    return _with_straight_corners(faces, len(flat)) if len(faces) else None


def _with_straight_corners(faces: Ints, count: int) -> Ints:
    """Triangles of all `count` corners of a polygon: ear clipping leaves out those at which it goes straight on."""
    used = np.unique(faces)
    if len(used) == count:
        return faces
    third = {(face[k], face[k - 2]): face[k - 1] for face in faces.tolist() for k in range(3)}
    out = {tuple(sorted(face)): face for face in faces.tolist()}
    for corner, following in zip(used.tolist(), np.roll(used, -1).tolist(), strict=True):
        between = [(corner + step) % count for step in range(1, (following - corner) % count)]
        apex = third.get((corner, following))
        if between and apex is not None:
            # a fan in place of the triangle at that edge; its other edges now belong to the outer triangles of the fan
            chain = [corner, *between, following]
            out.pop(tuple(sorted((corner, following, apex))), None)
            out |= {tuple(sorted((a, b, apex))): [a, b, apex] for a, b in itertools.pairwise(chain)}
            third[apex, corner], third[following, apex] = chain[1], chain[-2]
    return np.array([*out.values()])
