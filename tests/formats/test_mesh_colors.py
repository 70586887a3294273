"""Colors of meshes, as their files have them."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from trimesh.visual.material import PBRMaterial
from trimesh.visual.texture import TextureVisuals

from odeform.formats.reading import read_geometry
from odeform.geometry.parts import split
from odeform.geometry.region import Sphere
from odeform.types import Mesh

RED, GREEN = (220, 40, 30), (20, 160, 60)
QUAD = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"


def _read(path: Path) -> Mesh:
    mesh = read_geometry(path)
    assert isinstance(mesh, Mesh)
    return mesh


def _read_colors(path: Path) -> np.ndarray:
    colors = _read(path).colors
    assert colors is not None
    return colors.astype(int)


def test_vertex_colors_of_ply(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(1)
    colors = np.random.default_rng(0).integers(0, 256, (len(ball.vertices), 4)).astype(np.uint8)
    colors[:, 3] = 255
    ball.visual.vertex_colors = colors
    ball.export(tmp_path / "ball.ply")
    mesh = _read(tmp_path / "ball.ply")
    assert mesh.colors is not None
    nearest = np.abs(mesh.points[mesh.faces][:, :, None] - ball.vertices).sum(axis=3).argmin(axis=2)
    np.testing.assert_array_equal(mesh.colors, colors[nearest, :3])


def test_materials_of_a_gltf_scene_stay_with_their_parts(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    for x, color in ((0.0, RED), (3.0, GREEN)):
        linear = [((c / 255.0 + 0.055) / 1.055) ** 2.4 for c in color]
        ball = trimesh.creation.icosphere(1)
        ball.visual = TextureVisuals(material=PBRMaterial(baseColorFactor=[*linear, 1.0]))
        scene.add_geometry(ball.apply_translation([x, 0.0, 0.0]))
    scene.export(tmp_path / "two.glb")
    mesh = _read(tmp_path / "two.glb")
    assert mesh.colors is not None
    right = mesh.points[mesh.faces][:, :, 0].mean(axis=1) > 1.5
    assert np.abs(mesh.colors[~right].astype(int) - RED).max() <= 6  # trimesh keeps factors in 8 bits
    assert np.abs(mesh.colors[right].astype(int) - GREEN).max() <= 6
    # a part keeps its own
    part, _ = split(mesh, Sphere(np.array([3.0, 0.0, 0.0]), 1.5))
    assert isinstance(part, Mesh)
    assert part.colors is not None
    assert np.abs(part.colors.astype(int) - GREEN).max() <= 6


def test_a_texture_is_sampled_at_the_corners(tmp_path: Path) -> None:
    pixels = np.zeros((64, 64, 3), np.uint8)
    pixels[:, :32], pixels[:, 32:] = RED, GREEN
    Image.fromarray(pixels).save(tmp_path / "image.png")
    (tmp_path / "quad.mtl").write_text("newmtl one\nKd 1 1 1\nmap_Kd image.png\n")
    (tmp_path / "quad.obj").write_text(f"mtllib quad.mtl\n{QUAD}usemtl one\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n")
    mesh, colors = _read(tmp_path / "quad.obj"), _read_colors(tmp_path / "quad.obj")
    left = mesh.points[mesh.faces][:, :, 0] < 0.5
    assert np.abs(colors[left] - RED).max() <= 1
    assert np.abs(colors[~left] - GREEN).max() <= 1


@pytest.mark.parametrize("lines", ["", "mtllib missing.mtl\nusemtl one\n"])
def test_a_mesh_without_colors_has_none(tmp_path: Path, lines: str) -> None:
    (tmp_path / "quad.obj").write_text(f"{lines}{QUAD}f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n")
    assert _read(tmp_path / "quad.obj").colors is None
