"""Base colors of primitives: of vertices, materials and textures.

https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html, section 3.9, and the extensions KHR_texture_transform,
KHR_materials_pbrSpecularGlossiness, EXT_texture_webp.
"""

import io

import numpy as np
from jaxtyping import UInt8
from numpy.typing import NDArray

from odeform.errors import InputError
from odeform.formats.beside import pixels_of
from odeform.formats.colors import to_linear, to_srgb
from odeform.formats.gltf.accessors import read_floats
from odeform.formats.gltf.document import Document, Tree
from odeform.formats.gltf.primitives import attributes_of
from odeform.formats.textures import CLAMP, MIRROR, REPEAT, sampled
from odeform.types import Floats

__all__ = ["Materials"]

WRAPS = {33071: CLAMP, 33648: MIRROR, 10497: REPEAT}
OTHER_SOURCES = ("EXT_texture_webp", "EXT_texture_avif", "KHR_texture_basisu", "MSFT_texture_dds")
TOPS = {5121: 255.0, 5123: 65535.0}
"""Largest colors by the type of their components."""
GLOSSY = "KHR_materials_pbrSpecularGlossiness"


class Materials:
    """The colors of a document's primitives; each image is read once."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._images: dict[int, NDArray[np.uint8] | None] = {}

    def colors(self, primitive: Tree, count: int) -> UInt8[np.ndarray, "vertices 3"] | None:
        """sRGB colors of `count` vertices; None where neither they nor a material have any."""
        document, attributes = self._document, attributes_of(self._document, primitive)
        painted = self._painted(attributes, count)
        if "material" not in primitive:
            return None if painted is None else to_srgb(painted)
        material = document.item("materials", primitive["material"])
        surface = document.extension(material, GLOSSY)
        names = ("diffuseFactor", "diffuseTexture") if surface else ("baseColorFactor", "baseColorTexture")
        surface = surface or material.get("pbrMetallicRoughness")
        surface = surface if isinstance(surface, dict) else {}
        colors = np.ones((count, 3)) if painted is None else painted
        colors = colors * self._factor(surface.get(names[0], (1.0, 1.0, 1.0, 1.0)))
        texture = surface.get(names[1])
        if isinstance(texture, dict):
            sample = self._sampled(texture, attributes, count)
            colors = colors if sample is None else colors * sample
        return to_srgb(colors)

    def _factor(self, values: object) -> Floats:
        try:
            return np.array(values, dtype=float).reshape(-1)[:3].reshape(3)
        except (TypeError, ValueError):
            raise InputError(f"{self._document.where}: expected a color factor of numbers, got {values!r}") from None

    def _painted(self, attributes: Tree, count: int) -> Floats | None:
        if "COLOR_0" not in attributes:
            return None
        document, index = self._document, attributes["COLOR_0"]
        width = 4 if document.item("accessors", index).get("type") == "VEC4" else 3
        colors = read_floats(document, index, width, count)[:, :3]
        # bytes that are not said to be fractions are those of a program that forgot to
        top = TOPS.get(document.number(document.item("accessors", index), "componentType"), 1.0)
        return colors / top if colors.max(initial=0.0) > 1.0 else colors

    def _sampled(self, use: Tree, attributes: Tree, count: int) -> Floats | None:
        """(N, 3) linear colors of a texture at the vertices; None, with a note, where there are none."""
        document = self._document
        texture = document.item("textures", use.get("index"))
        image = self._image(texture)
        transform = document.extension(use, "KHR_texture_transform") or {}
        channel = document.number({**use, **{k: v for k, v in transform.items() if k == "texCoord"}}, "texCoord", 0)
        name = f"TEXCOORD_{channel}"
        if image is None:
            return None
        if name not in attributes:
            document.note("a texture left out: the mesh has no coordinates of it")
            return None
        uv = read_floats(document, attributes[name], 2, count)
        if transform:
            uv = self._transformed(uv, transform)
        sampler = document.item("samplers", texture["sampler"]) if "sampler" in texture else {}
        wraps = [WRAPS.get(document.number(sampler, side, 10497), REPEAT) for side in ("wrapS", "wrapT")]
        # v points down in glTF, and up in `sampled`
        return to_linear(sampled(image, uv * (1.0, -1.0) + (0.0, 1.0), (wraps[0], wraps[1])) / 255.0)

    def _transformed(self, uv: Floats, transform: Tree) -> Floats:
        try:
            offset = np.array(transform.get("offset", (0.0, 0.0)), dtype=float).reshape(2)
            scale = np.array(transform.get("scale", (1.0, 1.0)), dtype=float).reshape(2)
            angle = float(transform.get("rotation", 0.0))
        except (TypeError, ValueError):
            raise InputError(f"{self._document.where}: KHR_texture_transform: expected numbers") from None
        cos, sin = np.cos(angle), np.sin(angle)
        return (uv * scale) @ np.array([[cos, -sin], [sin, cos]]) + offset

    def _image(self, texture: Tree) -> NDArray[np.uint8] | None:
        document = self._document
        index, kind = texture.get("source"), ""
        for name in OTHER_SOURCES:
            other = document.extension(texture, name)
            if other is not None and (index is None or name == OTHER_SOURCES[0]):
                index, kind = other.get("source"), f" of {name}"
        if index is None:
            document.note("a texture left out: it names no image")
            return None
        source = document.item("images", index)
        assert isinstance(index, int)
        if index not in self._images:
            self._images[index] = self._read(source, kind)
        return self._images[index]

    def _read(self, source: Tree, kind: str) -> NDArray[np.uint8] | None:
        document, uri = self._document, source.get("uri")
        if isinstance(uri, str):
            data, name = document.read_beside(uri), "" if uri.startswith("data:") else f" {uri[:100]}"
        else:
            data, name = document.view(source.get("bufferView")), ""
        if data is None:
            document.note(f"the texture{name} left out: no such file")
            return None
        pixels = pixels_of(io.BytesIO(data))
        if pixels is None:
            document.note(f"the texture{name}{kind} left out: its image cannot be read")
        return pixels
