"""Colors of OBJ files: materials (.mtl) and their textures."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from odeform.formats.beside import file_beside, read_image
from odeform.formats.text import plain_text
from odeform.formats.textures import CLAMP, REPEAT, sampled
from odeform.types import Floats, Ints

__all__ = ["material_colors"]

LARGEST = 1 << 24  # bytes of a .mtl
ARGUMENTS = {"-mm": 2, "-bm": 1, "-blendu": 1, "-blendv": 1, "-boost": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1}
ARGUMENTS |= {"-texres": 1, "-type": 1}
VECTORS = ("-o", "-s", "-t")  # followed by one to three numbers


@dataclass
class _Material:
    color: Floats | None = None
    """The diffuse part, 0 to 255."""
    texture: str = ""
    file: Path = Path()
    """In which the material stands; the name of a texture is relative to it."""
    clamped: bool = False


def material_colors(
    path: Path,
    libraries: list[str],
    used: list[tuple[int, str]],
    line: Ints,
    uv: Floats | None,
    painted: Floats | None,
    notes: list[str],
) -> NDArray[np.uint8] | None:
    """sRGB colors (F, 3, 3) at the corners of triangles; None if there are none.

    Args:
        path: The file.
        libraries: Names of its files of materials.
        used: The line from which on a material is used, and its name.
        line: (F,) the line of each triangle.
        uv: (F, 3, 2) texture coordinates.
        painted: (F, 3, 3) colors of vertices, 0 to 255, which hold where there is no texture.
        notes: What is left out is added to these.
    """
    known = _materials(path, libraries, notes) if used else {}
    names = list(dict.fromkeys(name for _, name in used))
    # the last entry is for faces before the first material
    material_of = np.array([*(names.index(name) for _, name in used), -1])
    of_face = material_of[np.searchsorted([start for start, _ in used], line) - 1]
    out = np.full((len(line), 3, 3), 255.0) if painted is None else painted.copy()
    colored = painted is not None
    for index, name in enumerate(names):
        chosen, material = of_face == index, known.get(name)
        if material is None or not chosen.any():
            continue
        image = read_image((material.file, path), material.texture, notes) if material.texture else None
        if image is not None and uv is not None:
            wrap = CLAMP if material.clamped else REPEAT
            out[chosen] = sampled(image, uv[chosen].reshape(-1, 2), (wrap, wrap)).reshape(-1, 3, 3)
            colored = True
        elif material.color is not None and painted is None:
            out[chosen] = material.color
            colored = True
    return np.round(out).astype(np.uint8) if colored else None


def _materials(path: Path, libraries: list[str], notes: list[str]) -> dict[str, _Material]:
    known: dict[str, _Material] = {}
    for names in dict.fromkeys(libraries):
        # one name with spaces, or several names
        files = [file for name in (names, *names.split()) if (file := file_beside(path, name))][:8]
        if not files:
            notes.append(f"materials left out: no file {names[:100]}")
        for file in dict.fromkeys(files):
            _read_library(file, known)
    return known


def _read_library(file: Path, known: dict[str, _Material]) -> None:
    with file.open("rb") as opened:
        text = plain_text(opened.read(LARGEST)).decode("utf-8", "replace")
    material = _Material()
    for entry in text.splitlines():
        word, _, rest = entry.strip().partition(" ")
        rest, word = rest.strip(), word.lower()
        if word == "newmtl":
            material = known.setdefault(rest, _Material(file=file))
        elif word == "kd":
            try:
                color = np.array([float(value) for value in rest.split()[:3]])
            except ValueError:  # a spectral file
                continue
            if color.shape == (3,) and np.isfinite(color).all():
                material.color = 255.0 * np.clip(color, 0.0, 1.0)
        elif word == "map_kd":
            material.texture, material.clamped = _named(rest)


def _named(rest: str) -> tuple[str, bool]:
    """The file of a map, behind options, and whether it is not repeated."""
    words, clamped = rest.split(" "), False
    while words and words[0] in (*ARGUMENTS, *VECTORS, ""):
        option = words.pop(0)
        if option == "-clamp":
            clamped = words[:1] == ["on"]
        if option in VECTORS:
            while words and _is_number(words[0]):
                words.pop(0)
        else:
            del words[: ARGUMENTS.get(option, 0)]
    return " ".join(words).strip(), clamped


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
