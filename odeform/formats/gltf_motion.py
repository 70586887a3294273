"""A motion as an animated glTF: the rigid motion moves a node, morph targets deform its mesh.

https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html, sections 3.7 (meshes, morph targets) and 3.11 (animations).
"""

from importlib.metadata import version
from typing import IO, Any

import numpy as np

from odeform.budget import MEMORY
from odeform.errors import InputError
from odeform.formats.colors import to_linear
from odeform.formats.glb import INDICES, VERTICES, GlbBuffer
from odeform.formats.keyframes import Keyframes, keyframes, quaternions
from odeform.geometry.normals import vertex_normals
from odeform.geometry.shape import FittedShape
from odeform.geometry.similarity import UPRIGHT, Similarity
from odeform.motion.base import Motion
from odeform.motion.caveats import caveats
from odeform.types import Faces, Floats, Frames, Ints, Mesh, Points, Times

__all__ = ["write_glb"]

TOLERANCE = 5e-6  # m of a vertex; single precision of readers adds to it, up to 1e-5 m
LARGEST = 2000  # frames; the modes of more take minutes
POINT_BYTES = 120  # of memory for a point of a frame
SURFACE = {"metallicFactor": 0.0, "roughnessFactor": 0.8}
GRAY = (0.6, 0.6, 0.6, 1.0)  # linear, of meshes without colors


def write_glb(file: IO[bytes], motion: Motion, times: Times, fit: FittedShape | None) -> None:
    """An animation of a mesh over `times` (T,) s: every vertex of every frame is within 1e-5 m of the motion's own.

    A node has the rigid motion, morph targets the deformation (`odeform.formats.morph_targets`), and a root node turns
    the scene's z axis to glTF's y. With `fit`, lengths are in the units of its file, and the part that stands still is
    a mesh of its own. Vertices are split where the colors of their corners differ. `asset.extras` has `notes`
    (`odeform.motion.caveats`), `status` and `parameters`.

    Raises:
        InputError: Points or splats, negative times, or too many frames.
    """
    mesh = motion.geometry
    if not isinstance(mesh, Mesh):
        raise InputError(f".glb holds meshes only, got a {type(mesh).__name__}: use .npz, or one .ply per frame")
    distinct = np.unique(np.asarray(times, dtype=np.float32)).astype(float)
    _require_modest(distinct, len(mesh.points))
    back = fit.transform.inverse if fit else Similarity()
    keys, buffer = keyframes(motion, distinct, back, TOLERANCE), GlbBuffer()
    upright = quaternions((UPRIGHT["+y"].T @ back.rotation.T)[None])[0]
    body = {"translation": keys.shifts[0].tolist(), "rotation": keys.rotations[0].tolist()}
    nodes = [{"name": "scene", "rotation": upright.tolist(), "children": [1]}, {"name": "body", "mesh": 0, **body}]
    shapes, meshes = [mesh], [_mesh(mesh, keys.rest, 0, buffer, keys)]
    if fit is not None and isinstance(fit.remainder, Mesh):
        shapes.append(fit.remainder)
        meshes.append(_mesh(fit.remainder, fit.remainder.points, 1, buffer))
        nodes[0]["children"] = [1, 2]
        nodes.append({"name": "surroundings", "mesh": 1})
    extras = {"notes": caveats(motion, times), "status": motion.status, "parameters": dict(motion.parameters)}
    tree: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": f"odeform {version('odeform')}", "extras": extras},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [_material(shape) for shape in shapes],
        "animations": [_animation(keys, buffer)],
    }
    file.write(buffer.document(tree))


def _require_modest(times: Times, points: int) -> None:
    if times[0] < 0.0:
        raise InputError(f".glb: expected times from 0 s on, got {times[0]:g} s")
    size = POINT_BYTES * len(times) * points
    if len(times) > LARGEST or size > MEMORY:
        raise InputError(
            f".glb: {len(times):,} frames of {points:,} points take {size / 1e9:.3g} GB of memory; expected at most "
            f"{LARGEST:,} frames and 2 GB: use fewer frames, or .npz"
        )


def _material(mesh: Mesh) -> dict[str, Any]:
    plain = {} if mesh.colors is not None else {"baseColorFactor": GRAY}
    return {"doubleSided": True, "pbrMetallicRoughness": {**SURFACE, **plain}}


def _mesh(
    mesh: Mesh, points: Points, material: int, buffer: GlbBuffer, keys: Keyframes | None = None
) -> dict[str, Any]:
    """The faces and colors of a mesh, with its vertices at `points`; with `keys`, their targets."""
    corners, faces, colors = _split(mesh)
    normals = _normals(points, mesh.faces)
    attributes = {
        "POSITION": buffer.add(points[corners], VERTICES),
        "NORMAL": buffer.add(normals[corners], VERTICES),
    }
    if colors is not None:
        attributes["COLOR_0"] = buffer.add(colors, VERTICES)
    part = {
        "attributes": attributes,
        "indices": buffer.add(faces.ravel(), INDICES),
        "material": material,
    }
    if keys is None or not len(keys.targets):
        return {"primitives": [part]}
    part["targets"] = [
        {"POSITION": buffer.add(target[corners], VERTICES), "NORMAL": buffer.add(turned[corners], VERTICES)}
        for target, turned in zip(keys.targets, _normal_targets(keys, mesh, normals), strict=True)
    ]
    names = [f"mode {index + 1}" for index in range(len(keys.targets))]
    return {"primitives": [part], "weights": keys.weights[0].tolist(), "extras": {"targetNames": names}}


def _split(mesh: Mesh) -> tuple[Ints, Faces, Floats | None]:
    """Vertices (M,) of the mesh, faces (F, 3) that index them, and linear colors (M, 3), one for each."""
    if mesh.colors is None:
        return np.arange(len(mesh.points)), mesh.faces, None
    rows = np.concatenate([mesh.faces.reshape(-1, 1), mesh.colors.reshape(-1, 3)], axis=1)
    unique, index = np.unique(rows, axis=0, return_inverse=True)
    return unique[:, 0], index.reshape(-1, 3), to_linear(unique[:, 1:] / 255.0)


def _normals(points: Points, faces: Faces) -> Points:
    """(N, 3) unit normals, +z where faces give none."""
    normals = vertex_normals(np.asarray(points, dtype=float), faces)
    size = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(size > 0.5, normals / np.maximum(size, 0.5), (0.0, 0.0, 1.0))


def _normal_targets(keys: Keyframes, mesh: Mesh, rest: Points) -> Frames:
    """(K, N, 3) changes of normals that, weighted as the targets, fit those of all frames best."""
    inverse, out = np.linalg.pinv(keys.weights.astype(float)), np.zeros(keys.targets.shape)
    for weights, column in zip(keys.weights, inverse.T, strict=True):
        points = keys.rest + np.tensordot(weights, keys.targets, 1)
        out += column[:, None, None] * (_normals(points, mesh.faces) - rest)
    return out


def _animation(keys: Keyframes, buffer: GlbBuffer) -> dict[str, Any]:
    times = buffer.add(keys.times)
    curves = {"translation": keys.shifts, "rotation": keys.rotations}
    if len(keys.targets):
        curves["weights"] = keys.weights.ravel()
    return {
        "name": "motion",
        "samplers": [
            {"input": times, "output": buffer.add(curve), "interpolation": "LINEAR"} for curve in curves.values()
        ],
        "channels": [{"sampler": index, "target": {"node": 1, "path": path}} for index, path in enumerate(curves)],
    }
