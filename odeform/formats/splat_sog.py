"""PlayCanvas' .sog: Gaussian splats as images, in a zip archive with a table of contents, version 2.

https://developer.playcanvas.com/user-manual/gaussian-splatting/formats/sog/
"""

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from odeform.budget import MEMORY, require_memory
from odeform.errors import InputError
from odeform.geometry.ellipsoids import covariances_from_axes, with_fourth
from odeform.io import parse_json
from odeform.types import Floats, GaussianSplats, Harmonics

__all__ = ["read_sog"]

SPLAT_BYTES = 500  # of memory while reading
COEFFICIENTS = (0, 3, 8, 15)  # further harmonics, by degree
ACROSS = 64  # entries of a palette of harmonics in a row
LARGEST = 252  # of a byte of rotation: this one and the next say which component is left out


class _Archive:
    """The table of contents, and the images that it names."""

    def __init__(self, path: Path) -> None:
        self.where = f"geometry {path}"
        try:
            self._zip = zipfile.ZipFile(path)
            names = [name for name in self._zip.namelist() if name.rpartition("/")[2] == "meta.json"]
        except (zipfile.BadZipFile, OSError, ValueError):
            raise InputError(f"{self.where}: expected a zip archive with a directory at its end: truncated?") from None
        if not names:
            raise InputError(f"{self.where}: expected a meta.json in the archive, got none")
        self._folder = names[0].removesuffix("meta.json")
        self.meta = parse_json(self._content(names[0]), self.where)
        version = self.meta.get("version") if isinstance(self.meta, dict) else None
        if version != 2:
            raise InputError(f"{self.where}: expected .sog of version 2, got {version!r}: save it again, or as .ply")
        self.count = self._number(self.meta.get("count"))
        require_memory(self.where, f"{self.count:,} splats", SPLAT_BYTES * self.count)

    def part(self, name: str) -> dict[str, Any]:
        """Returns what the table says of one property."""
        part = self.meta.get(name)
        if not isinstance(part, dict):
            raise InputError(f"{self.where}: expected {name} in meta.json")
        return part

    def pixels(self, name: str, index: int = 0, least: int | None = None) -> NDArray[np.uint8]:
        """(M, 4) bytes of an image of at least as many pixels as there are splats."""
        files = self.part(name).get("files")
        if not isinstance(files, list) or len(files) <= index or not isinstance(files[index], str):
            raise InputError(f"{self.where}: expected {index + 1} files of {name} in meta.json")
        try:
            with Image.open(io.BytesIO(self._content(self._folder + files[index]))) as image:
                require_memory(self.where, f"{image.width} x {image.height} pixels", 8 * image.width * image.height)
                pixels = np.asarray(image.convert("RGBA")).reshape(-1, 4)
        except InputError:
            raise
        except Exception as error:
            # Pillow raises anything on a broken file
            raise InputError(f"{self.where}: {files[index][:40]}: expected an image: {error}") from None
        if len(pixels) < (self.count if least is None else least):
            raise InputError(f"{self.where}: {files[index][:40]}: expected {self.count:,} pixels, got {len(pixels):,}")
        return pixels[: self.count] if least is None else pixels

    def numbers(self, name: str, entry: str, count: int | None = None) -> Floats:
        """(M,) numbers of the table."""
        try:
            values = np.array(self.part(name).get(entry), dtype=float).reshape(-1)
        except (TypeError, ValueError):
            values = np.zeros(0)
        if not len(values) or (count is not None and len(values) != count) or not np.isfinite(values).all():
            raise InputError(f"{self.where}: expected {count or 'some'} numbers of {name}.{entry} in meta.json")
        return values

    def palette(self, name: str, indices: NDArray[np.uint8]) -> Floats:
        """The numbers of a codebook that `indices` name."""
        book = self.numbers(name, "codebook")
        if indices.size and int(indices.max()) >= len(book):
            raise InputError(f"{self.where}: {name} refers to entry {indices.max()} of a codebook of {len(book)}")
        return book[indices]

    def _content(self, name: str) -> bytes:
        try:
            size = self._zip.getinfo(name).file_size
            require_memory(self.where, f"{size:,} bytes of {name[:40]}", size * 2)
            with self._zip.open(name) as file:
                return file.read(MEMORY >> 2)
        except KeyError:
            raise InputError(f"{self.where}: expected {name[:60]} in the archive, got no such file") from None
        except InputError:
            raise
        except Exception as error:
            # zlib and zipfile raise several kinds of errors on a broken member
            raise InputError(f"{self.where}: {name[:60]}: damaged: {error}") from None

    def _number(self, value: object) -> int:
        if not isinstance(value, int) or isinstance(value, bool) or not 0 < value < 1 << 32:
            raise InputError(f"{self.where}: expected a number of splats in meta.json, got {value!r}")
        return value


def read_sog(path: Path, merge: bool) -> GaussianSplats:
    """Reads all splats of an archive, in its axes.

    Raises:
        InputError: For version 1, and for missing or damaged images.
    """
    archive = _Archive(path)
    low, high = (archive.pixels("means", index)[:, :3].astype(float) for index in (0, 1))
    first, last = (archive.numbers("means", end, 3) for end in ("mins", "maxs"))
    positions = first + (low + 256.0 * high) / 65535.0 * (last - first)
    points = np.sign(positions) * np.expm1(np.abs(positions))  # far splats have coarser places
    scales = np.exp(archive.palette("scales", archive.pixels("scales")[:, :3]))
    colors = archive.pixels("sh0")
    harmonics = archive.palette("sh0", colors[:, :3]).astype(np.float32)[:, None]
    if isinstance(archive.meta.get("shN"), dict):
        harmonics = np.concatenate([harmonics, _further(archive)], axis=1)
    covariances = covariances_from_axes(scales, _quaternions(archive.pixels("quats")))
    return GaussianSplats(points.astype(np.float32), covariances, harmonics, colors[:, 3] / np.float32(255.0))


def _quaternions(pixels: NDArray[np.uint8]) -> Floats:
    """(N, 4), w first: three components, and which of w, x, y, z is left out; the identity where none is."""
    others = (pixels[:, :3] / 255.0 * 2.0 - 1.0) * np.sqrt(0.5)
    left_out = pixels[:, 3].astype(int) - LARGEST
    known = left_out >= 0
    return np.where(known[:, None], with_fourth(others, np.maximum(left_out, 0)), (1.0, 0.0, 0.0, 0.0))


def _further(archive: _Archive) -> Harmonics:
    """(N, H, 3) coefficients: each splat has one entry of a palette."""
    part = archive.part("shN")
    degree = part.get("bands")
    if degree not in (1, 2, 3):
        raise InputError(f"{archive.where}: expected shN of 1 to 3 bands, got {degree!r}")
    each = COEFFICIENTS[degree]
    labels = archive.pixels("shN", 1).astype(np.int64)
    entries = archive.pixels("shN", 0, 0)[:, :3]
    usable = len(entries) // (ACROSS * each) * ACROSS * each
    palette = entries[:usable].reshape(-1, each, 3)
    label = labels[:, 0] + 256 * labels[:, 1]
    if label.max(initial=0) >= len(palette):
        raise InputError(f"{archive.where}: a splat refers to harmonics {label.max()}, of {len(palette)}")
    return archive.palette("shN", palette[label]).astype(np.float32)
