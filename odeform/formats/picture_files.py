"""Pictures and films as files. What has to be known of the motion is in their metadata."""

import io
from collections.abc import Sequence

import numpy as np
from jaxtyping import UInt8
from PIL import Image
from PIL.PngImagePlugin import PngInfo

__all__ = ["Picture", "png_bytes", "webp_bytes"]

DESCRIPTION = 0x010E  # "ImageDescription" of EXIF
QUALITY, METHOD = 80, 4  # of WebP; slower methods save a tenth

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
