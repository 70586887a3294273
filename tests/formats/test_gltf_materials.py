"""Textures and materials of glTF."""

from pathlib import Path

import numpy as np
import pytest
from fuzz.gltf_files import Gltf
from PIL import Image

from odeform.formats.reading import read_geometry
from odeform.types import Mesh


def _mesh(path: Path) -> Mesh:
    mesh = read_geometry(path)
    assert isinstance(mesh, Mesh)
    return mesh


def _textured(file: Gltf, texture: dict, images: list) -> Gltf:
    file.primitive["attributes"]["TEXCOORD_0"] = file.add(np.full((4, 2), 0.5, np.float32))
    file.primitive["material"] = 0
    file.tree |= {
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [texture],
        "images": images,
    }
    return file


def test_a_texture_that_cannot_be_read_is_noted(tmp_path: Path) -> None:
    file = Gltf()
    images = [{"bufferView": file.view(b"\xabKTX 20\xbb" + bytes(52)), "mimeType": "image/ktx2"}]
    _textured(file, {"extensions": {"KHR_texture_basisu": {"source": 0}}}, images)
    file.tree["extensionsRequired"] = ["KHR_texture_basisu"]
    mesh = _mesh(file.glb(tmp_path / "a.glb"))
    assert any("KHR_texture_basisu left out" in note for note in mesh.notes)
    missing = _textured(Gltf(), {"source": 0}, [{"uri": "no%20such.png"}]).glb(tmp_path / "b.glb")
    assert any("no%20such.png left out: no such file" in note for note in _mesh(missing).notes)


@pytest.mark.parametrize("kind", ["png", "webp"])
def test_textures_of_images_beside_the_file(tmp_path: Path, kind: str) -> None:
    Image.new("RGB", (8, 8), (200, 30, 40)).save(tmp_path / f"a b.{kind}", lossless=True)
    texture = {"source": 0} if kind == "png" else {"extensions": {"EXT_texture_webp": {"source": 0}}}
    file = _textured(Gltf(), texture, [{"uri": f"a%20b.{kind}"}])
    colors = _mesh(file.glb(tmp_path / "a.glb")).colors
    assert colors is not None
    assert np.abs(colors.astype(int) - (200, 30, 40)).max() <= 1


def test_a_texture_is_clamped_and_transformed_as_its_sampler_says(tmp_path: Path) -> None:
    pixels = np.zeros((1, 64, 3), np.uint8)
    pixels[:, 32:] = 255
    Image.fromarray(pixels).save(tmp_path / "half.png")
    file = _textured(Gltf(), {"source": 0, "sampler": 0}, [{"uri": "half.png"}])
    file.tree["samplers"] = [{"wrapS": 33071, "wrapT": 33071}]
    use = file.tree["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    for offset, value in ((0.9, 255), (-0.9, 0)):
        use["extensions"] = {"KHR_texture_transform": {"offset": [offset, 0.0]}}
        colors = _mesh(file.glb(tmp_path / "a.glb")).colors
        assert colors is not None
        assert (colors == value).all()


def test_diffuse_colors_of_another_model_of_materials(tmp_path: Path) -> None:
    Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "red.png")
    file = _textured(Gltf(), {"source": 0}, [{"uri": "red.png"}])
    glossy = {"diffuseFactor": [1.0, 1.0, 0.0, 1.0]}
    file.tree["materials"][0]["extensions"] = {"KHR_materials_pbrSpecularGlossiness": glossy}
    for diffuse, color in (({}, [255, 255, 0]), ({"diffuseTexture": {"index": 0}}, [255, 0, 0])):
        glossy |= diffuse
        colors = _mesh(file.glb(tmp_path / "a.glb")).colors
        assert colors is not None
        assert (colors == color).all()
