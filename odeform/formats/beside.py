"""Files that lie beside a shape: materials and textures that it names."""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

__all__ = ["file_beside", "pixels_of", "read_image"]


def file_beside(path: Path, name: str) -> Path | None:
    """Finds the file that `path` names: in its folder or below, else one of that name in its folder; None without.

    Names of other machines, such as C:\\textures\\ball.png, are looked for by their last part.
    """
    folder = path.parent.resolve()
    name = name.strip().strip('"').replace("\\", "/")
    for candidate in (name, name.rpartition("/")[2]):
        try:
            file = (folder / candidate).resolve()
            if candidate and file.is_relative_to(folder) and file.is_file():
                return file
        except (OSError, ValueError):  # a name that no file can have
            continue
    return None


def read_image(paths: Sequence[Path], name: str, notes: list[str]) -> NDArray[np.uint8] | None:
    """The texture `name` beside the first of `paths` that has it, (H, W, 3) in sRGB.

    Where it cannot be read, `notes` say so, once.
    """
    file = next((file for path in paths if (file := file_beside(path, name))), None)
    image = pixels_of(file) if file else None
    if image is None:
        note = f"the texture {name[:100]} left out: {'its image cannot be read' if file else 'no such file'}"
        if note not in notes:
            notes.append(note)
    return image


def pixels_of(file: Path | BytesIO) -> NDArray[np.uint8] | None:
    """An image as (H, W, 3) in sRGB; None where it cannot be read."""
    try:
        image = Image.open(file)
        return np.asarray(image if image.mode == "RGB" else image.convert("RGB"))
    except Exception:
        # Pillow raises anything on a broken file
        return None
