"""Pictures and films as files. What has to be known of the motion is in their metadata."""

import io
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from odeform.errors import InputError

__all__ = ["FFMPEG", "Picture", "mp4_bytes", "png_bytes", "webp_bytes"]

DESCRIPTION = 0x010E  # "ImageDescription" of EXIF
QUALITY, METHOD = 80, 4  # of WebP; slower methods save a tenth

FFMPEG = shutil.which("ffmpeg")
"""The program that encodes `.mp4`; None where there is none."""

Picture = UInt8[np.ndarray, "height width 3"]


def png_bytes(picture: Picture, notes: Sequence[str]) -> bytes:
    """Encodes a PNG file of (H, W, 3) pixels, with `notes` as its text `Description`."""
    info, file = PngInfo(), io.BytesIO()
    if notes:
        info.add_itxt("Description", ". ".join(notes))
    Image.fromarray(picture).save(file, "PNG", pnginfo=info)
    return file.getvalue()


def webp_bytes(pictures: Sequence[Picture], seconds: float | Sequence[float], notes: Sequence[str]) -> bytes:
    """An animated WebP file of pictures (H, W, 3), each shown for `seconds`, forever; `notes` are in its EXIF."""
    first, *others = (Image.fromarray(picture) for picture in pictures)
    exif, file = Image.Exif(), io.BytesIO()
    if notes:
        exif[DESCRIPTION] = ". ".join(notes).encode("ascii", "replace").decode()
    shown = [round(1000.0 * float(each)) for each in np.broadcast_to(seconds, len(pictures))]
    options = {"duration": shown, "loop": 0, "quality": QUALITY, "method": METHOD}
    first.save(file, "WEBP", save_all=True, append_images=others, exif=exif, **options)
    return file.getvalue()


def mp4_bytes(pictures: Sequence[Picture], seconds: float, notes: Sequence[str]) -> bytes:
    """An MP4 film (H.264) of pictures (H, W, 3), each shown for `seconds`; `notes` are its comment.

    `InputError` without ffmpeg, or where it fails. Odd rows and columns at the end are left out, as the format asks.
    """
    if FFMPEG is None:
        raise InputError("a film as .mp4: expected ffmpeg on the PATH")
    height, width = (side // 2 * 2 for side in pictures[0].shape[:2])
    with tempfile.TemporaryDirectory(prefix="odeform-") as folder:
        path = Path(folder) / "film.mp4"
        given = [
            "-f",
            "rawvideo",
            "-pix_fmt",
            "rgb24",
            "-s",
            f"{width}x{height}",
            "-r",
            f"{1.0 / seconds:g}",
            "-i",
            "-",
        ]
        made = ["-pix_fmt", "yuv420p", "-movflags", "+faststart", "-metadata", f"comment={'. '.join(notes)}", str(path)]
        raw = b"".join(np.ascontiguousarray(picture[:height, :width]).tobytes() for picture in pictures)
        done = subprocess.run(
            [FFMPEG, "-loglevel", "error", *given, *made], input=raw, capture_output=True, check=False
        )
        if done.returncode:
            raise InputError(f"ffmpeg: {done.stderr.decode(errors='replace').strip() or done.returncode}")
        return path.read_bytes()
