"""glTF 2.0, text or binary: all meshes of the default scene where they are placed, in the pose that the file gives."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from odeform.budget import require_memory
from odeform.errors import InputError, counted
from odeform.formats.gltf.document import Document, Tree, read_document
from odeform.formats.gltf.materials import Materials
from odeform.formats.gltf.nodes import Scene
from odeform.formats.gltf.primitives import LINES, Primitive, read_primitive
from odeform.formats.gltf.splats import EXTENSION, joined, read_splats
from odeform.types import Faces, Floats, GaussianSplats, Geometry, Mesh, PointCloud

__all__ = ["read_gltf"]

UP = "+y"  # section 3.4 of the specification: glTF defines +Y as up
VERTEX_BYTES = 400  # of memory while reading: a vertex or an index of a placed mesh
Colors = UInt8[np.ndarray, "vertices 3"]


@dataclass
class _Parts:
    """Holds what has been placed so far; `colors` has None for parts without."""

    points: list[Floats] = field(default_factory=list)
    faces: list[Faces] = field(default_factory=list)
    colors: list[Colors | None] = field(default_factory=list)
    count: int = 0

    def add(self, points: Floats, faces: Faces, colors: Colors | None) -> None:
        self.points.append(points)
        self.faces.append(faces + self.count)
        self.colors.append(colors)
        self.count += len(points)

    def painted(self) -> Colors | None:
        """The colors of all points, white for parts without; None if no part has any."""
        if all(colors is None for colors in self.colors):
            return None
        sizes = map(len, self.points)
        return np.concatenate(
            [np.full((n, 3), 255, np.uint8) if c is None else c for n, c in zip(sizes, self.colors, strict=True)]
        )


def read_gltf(path: Path, merge: bool) -> Geometry:
    """The triangles of all meshes, else their points, or Gaussian splats; y is up.

    Morph targets have their default weights, and bones the pose of the nodes. Lines, points beside triangles, other
    scenes, animations and images of unknown formats are left out, with a note.

    Raises:
        InputError: A damaged file, one that is compressed, or requires an extension that is not known.
    """
    document = read_document(path)
    scene, materials = Scene(document), Materials(document)
    meshes, clouds, splats = _Parts(), _Parts(), []
    placed = [*scene.placed()]
    total = sum(len(copies) * _size(document, mesh) for _, mesh, copies in placed)
    count = sum(len(copies) for *_, copies in placed)
    require_memory(document.where, f"{total:,} vertices and indices of {count:,} placed meshes", VERTEX_BYTES * total)
    lines = 0
    for node, mesh, copies in placed:
        joints, weights = scene.joints(node), _weights(document, node, mesh)
        for primitive in document.items("primitives", mesh):
            if document.extension(primitive, EXTENSION) is not None:
                splats += [read_splats(document, primitive, matrix) for matrix in copies]
            elif document.number(primitive, "mode", 4) in LINES:
                lines += 1
            else:
                part = read_primitive(document, primitive, weights, joints)
                colors = materials.colors(primitive, len(part.points)) if merge else None
                _place(clouds if primitive.get("mode") == 0 else meshes, part, colors, copies)
    if document.items("animations"):
        document.note("animation left out: the shape is in the pose of the file's nodes")
    if lines:
        document.note(f"{counted(lines, 'part')} of lines left out")
    return _joined(document, meshes, clouds, splats)


def _joined(document: Document, meshes: _Parts, clouds: _Parts, splats: list[GaussianSplats]) -> Geometry:
    if splats:
        if meshes.count or clouds.count:
            document.note(f"{counted(meshes.count + clouds.count, 'point')} of meshes beside the splats left out")
        whole = joined(splats)
        return GaussianSplats(
            whole.points, whole.covariances, whole.harmonics, whole.opacities, tuple(document.notes), UP
        )
    if meshes.count:
        if clouds.count:
            document.note(f"{counted(clouds.count, 'point')} beside the mesh left out")
        faces, colors = np.concatenate(meshes.faces), meshes.painted()
        corners = None if colors is None else colors[faces]
        return Mesh(np.concatenate(meshes.points), faces, corners, tuple(document.notes), UP)
    if not clouds.count:
        raise InputError(f"{document.where}: expected a mesh in a scene, got none: {_content(document)}")
    return PointCloud(np.concatenate(clouds.points), clouds.painted(), tuple(document.notes), UP)


def _content(document: Document) -> str:
    names = ("scenes", "nodes", "meshes")
    counts = [f"{len(document.items(name))} {name}" for name in names]
    return ", ".join([*counts, *(note for note in document.notes if "lines" in note)])


def _place(parts: _Parts, part: Primitive, colors: Colors | None, copies: Floats) -> None:
    if part.skinned:  # bones alone say where its vertices are
        parts.add(part.points, part.faces, colors)
        return
    for matrix in copies:
        # a mirrored part is turned inside out again
        faces = part.faces[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0.0 else part.faces
        parts.add(part.points @ matrix[:3, :3].T + matrix[:3, 3], faces, colors)


def _weights(document: Document, node: Tree, mesh: Tree) -> Floats:
    """(T,) weights of the morph targets."""
    values = node.get("weights", mesh.get("weights", []))
    try:
        weights = np.array(values, dtype=float).reshape(-1)
    except (TypeError, ValueError):
        raise InputError(f"{document.where}: weights: expected numbers, got {values!r}") from None
    return weights


def _size(document: Document, mesh: Tree) -> int:
    """Vertices and indices of all parts of a mesh."""
    total = 0
    for primitive in document.items("primitives", mesh):
        attributes = primitive.get("attributes")
        position = attributes.get("POSITION") if isinstance(attributes, dict) else None
        for index in (position, primitive.get("indices")):
            total += 0 if index is None else document.number(document.item("accessors", index), "count", 0)
    return total
