"""Colors of meshes that trimesh has read: of vertices or faces, materials, and textures sampled at the corners."""

from typing import Any

import numpy as np
import trimesh
from jaxtyping import UInt8
from trimesh.visual.color import uv_to_interpolated_color
from trimesh.visual.material import PBRMaterial
from trimesh.visual.texture import TextureVisuals

from odeform.types import Floats

__all__ = ["mesh_colors", "to_linear"]

UNSET = (102, 102, 102)  # of a material whose file is missing; trimesh then also makes an image of four pixels


Colors = UInt8[np.ndarray, "faces 3 3"]


def mesh_colors(loaded: Any, gltf: bool) -> Colors | None:
    """sRGB colors (F, 3, 3) at the corners of each face of a mesh, or of all meshes of a scene as they are placed.

    None if there are none; a mesh without colors among others is white.
    """
    if not isinstance(loaded, trimesh.Scene):
        return _corner_colors(loaded, gltf) if isinstance(loaded, trimesh.Trimesh) else None
    meshes = {name: part for name, part in loaded.geometry.items() if isinstance(part, trimesh.Trimesh)}
    known = {name: _corner_colors(mesh, gltf) for name, mesh in meshes.items() if len(mesh.vertices)}
    if all(colors is None for colors in known.values()):
        return None
    placed = []
    for node in loaded.graph.nodes_geometry:
        matrix, name = loaded.graph[node]
        if name in known:
            colors = known[name]
            colors = np.full((len(meshes[name].faces), 3, 3), 255, dtype=np.uint8) if colors is None else colors
            # the corners of a mirrored part are in the opposite order
            placed.append(colors[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0.0 else colors)
    return np.concatenate(placed) if placed else None


def _corner_colors(mesh: trimesh.Trimesh, linear: bool) -> Colors | None:
    """Those of one mesh. `linear` says that colors of vertices are stored without gamma, as glTF does."""
    visual: Any = mesh.visual
    if isinstance(visual, TextureVisuals):
        return _material_colors(mesh, visual)
    if visual.kind == "face":
        return np.repeat(np.asarray(visual.face_colors)[:, None, :3], 3, axis=1).astype(np.uint8)
    if visual.kind == "vertex":
        colors = np.asarray(visual.vertex_colors)[:, :3]
        return (_to_srgb(colors / 255.0) if linear else colors.astype(np.uint8))[mesh.faces]
    return None


def _material_colors(mesh: trimesh.Trimesh, visual: TextureVisuals) -> Colors | None:
    material: Any = visual.material
    gltf = isinstance(material, PBRMaterial)
    image = material.baseColorTexture if gltf else material.image
    if image is not None and not gltf and image.size == (2, 2):
        image = None
    factor = material.baseColorFactor if gltf else material.diffuse
    factor = np.full(3, 255) if factor is None else np.asarray(factor)[:3]
    painted = visual.vertex_attributes.get("color") if gltf else None
    if image is not None and visual.uv is not None:
        colors = to_linear(np.asarray(uv_to_interpolated_color(visual.uv, image))[:, :3] / 255.0)
        if gltf:  # elsewhere, programs write any factor beside a texture
            colors = colors * factor / 255.0
    elif not gltf and tuple(factor) == UNSET:
        return None
    else:
        colors = np.tile(factor / 255.0 if gltf else to_linear(factor / 255.0), (len(mesh.vertices), 1))
    if painted is not None:
        top = np.iinfo(painted.dtype).max if np.issubdtype(painted.dtype, np.integer) else 1.0
        colors = colors * np.asarray(painted)[:, :3] / top
    return _to_srgb(colors)[mesh.faces]


def to_linear(srgb: Floats) -> Floats:
    """(...) sRGB values, 0 to 1 -> (...) linear ones (IEC 61966-2-1)."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def _to_srgb(linear: Floats) -> UInt8[np.ndarray, "vertices 3"]:
    linear = np.clip(linear, 0.0, 1.0)
    return np.round(255.0 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)).astype(
        np.uint8
    )
