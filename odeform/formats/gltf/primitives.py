"""Primitives: the vertices of a part of a mesh in the pose that the file gives it, and its triangles.

https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html, section 3.7.
"""

from dataclasses import dataclass

import numpy as np

from odeform.errors import InputError
from odeform.formats.gltf.accessors import read_floats, read_indices
from odeform.formats.gltf.document import Document, Tree
from odeform.types import Faces, Floats, Ints

__all__ = ["LINES", "POINTS", "Primitive", "read_primitive"]

POINTS, LINES, TRIANGLES, STRIP, FAN = 0, (1, 2, 3), 4, 5, 6
MOST_INFLUENCES = 8  # sets of four bones of a vertex


@dataclass(frozen=True, eq=False)
class Primitive:
    """A part of a mesh.

    Attributes:
        points: (N, 3) in the frame of the mesh, or of the world where bones move them.
        faces: (F, 3); none of points.
        colored: The JSON of the primitive, which names its colors and material.
        skinned: Whether `points` are in the frame of the world.
    """

    points: Floats
    faces: Faces
    colored: Tree
    skinned: bool


def read_primitive(document: Document, primitive: Tree, weights: Floats, joints: Floats | None) -> Primitive:
    """Reads a part with morph targets added by `weights` (T,) and moved by `joints` (J, 4, 4), bound pose to world.

    Raises:
        InputError: For compressed or damaged data.
    """
    document.require_uncompressed(primitive)
    attributes = attributes_of(document, primitive)
    points = read_floats(document, attributes["POSITION"], 3)
    targets = document.items("targets", primitive)
    for weight, target in zip(weights, targets, strict=False):
        if weight and "POSITION" in target:
            points = points + weight * read_floats(document, target["POSITION"], 3, len(points))
    skinned = joints is not None and "JOINTS_0" in attributes
    if joints is not None and skinned:
        points = _skinned(document, points, attributes, joints)
    mode = document.number(primitive, "mode", TRIANGLES)
    if mode == POINTS:
        return Primitive(points, np.zeros((0, 3), np.int64), primitive, skinned)
    index = primitive.get("indices")
    corners = np.arange(len(points)) if index is None else read_indices(document, index, len(points))
    return Primitive(points, _triangles(document, corners, mode), primitive, skinned)


def attributes_of(document: Document, primitive: Tree) -> Tree:
    """Returns the attributes of a primitive. Raises `InputError` without positions."""
    attributes = primitive.get("attributes")
    if not isinstance(attributes, dict) or "POSITION" not in attributes:
        raise InputError(f"{document.where}: expected a primitive with positions")
    return attributes


def _triangles(document: Document, corners: Ints, mode: int) -> Faces:
    count = len(corners)
    if mode == TRIANGLES:
        if count % 3:
            raise InputError(f"{document.where}: expected three corners for each triangle, got {count} in all")
        return corners.reshape(-1, 3)
    if mode not in (STRIP, FAN):
        raise InputError(f"{document.where}: expected a primitive of mode 0 to 6, got {mode}")
    if count < 3:
        return np.zeros((0, 3), np.int64)
    first = np.arange(count - 2)
    if mode == STRIP:
        odd = first % 2
        faces = np.stack([corners[first], corners[first + 1 + odd], corners[first + 2 - odd]], axis=1)
    else:
        faces = np.stack([corners[first + 1], corners[first + 2], np.full(count - 2, corners[0])], axis=1)
    # strips are joined by triangles without area
    a, b, c = faces.T
    return faces[(a != b) & (b != c) & (c != a)]


def _skinned(document: Document, points: Floats, attributes: Tree, joints: Floats) -> Floats:
    """(N, 3) points moved by their bones."""
    blend, total = np.zeros((len(points), 4, 4)), np.zeros(len(points))
    for group in range(MOST_INFLUENCES):
        names = f"JOINTS_{group}", f"WEIGHTS_{group}"
        if not all(name in attributes for name in names):
            break
        bones = read_floats(document, attributes[names[0]], 4, len(points)).astype(int)
        influences = read_floats(document, attributes[names[1]], 4, len(points))
        if len(bones) and not 0 <= bones.min() <= bones.max() < len(joints):
            raise InputError(f"{document.where}: a vertex refers to bone {bones.max()}, of {len(joints)}")
        for k in range(4):
            blend += influences[:, k, None, None] * joints[bones[:, k]]
        total += influences.sum(axis=1)
    if len(total) and not (total > 1e-6).all():
        raise InputError(f"{document.where}: expected weights of bones for every vertex, got none for some")
    moved = np.einsum("nij,nj->ni", blend[:, :3, :3], points) + blend[:, :3, 3]
    return moved / total[:, None]
