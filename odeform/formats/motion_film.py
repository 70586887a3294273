"""A whole motion as a film (animated WebP), drawn without a browser."""

import textwrap
from collections.abc import Sequence
from typing import IO

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from odeform.errors import InputError
from odeform.formats.drawing import View, draw
from odeform.formats.picture_files import Picture, webp_bytes
from odeform.formats.writing import shape_at
from odeform.geometry.shape import FittedShape
from odeform.motion.base import Motion
from odeform.motion.caveats import caveats
from odeform.schema import OBJECT
from odeform.types import Floats, Times

__all__ = ["MOST", "SHORTEST", "write_webp"]

SIZE = (640, 480)  # px
MOST = 600
"""Frames of a film at most."""
SHORTEST = 0.04
"""Seconds that a frame is shown at least: faster motions are shown slower."""
STAY = 1.0  # s for which the last frame is shown
AROUND = 1.35  # what is shown, relative to what moves
FAR = 2.5  # extents of the body in each direction, beyond which the view follows it
TILES = 6  # squares of the floor along the height of the picture
INK, WARNING, FONT, LINE = (60, 60, 60), (179, 38, 30), 15, 80  # colours, px, characters


def write_webp(file: IO[bytes], motion: Motion, times: Times, fit: FittedShape | None) -> None:
    """A film of the motion at `times` (T,) s, slowed down to at most 25 frames per second, which its caption says.

    The view follows a body that goes far. The caption names the scene and the moment, and says what lies outside of
    what was trained. `InputError` for more than `MOST` frames.
    """
    if len(times) > MOST:
        raise InputError(f"a film has at most {MOST} frames, got {len(times)}: choose fewer times")
    frames = (motion.vertices(float(t)) for t in times)
    boxes = np.array([[points.min(axis=0), points.max(axis=0)] for points in frames], dtype=float)
    views, notes = _views(boxes), caveats(motion, times)
    steps = np.append(np.abs(np.diff(times)), STAY)
    seconds = np.maximum(steps, SHORTEST)
    slower = float(seconds[:-1].sum() / max(steps[:-1].sum(), 1e-9)) if len(times) > 1 else 1.0
    name = " ".join(filter(None, (motion.schema.scene, str(motion.parameters.get(OBJECT, "")))))
    speed = f", shown {slower:.2g} times slower" if slower > 1.05 else ""
    pictures = [
        _captioned(draw(shape_at(motion, float(t)), view), f"{name}, t = {t:.3f} s{speed}", notes)
        for t, view in zip(times, views, strict=True)
    ]
    file.write(webp_bytes(pictures, seconds.tolist(), notes))


def _views(boxes: Floats) -> list[View]:
    """A view for each box (T, 2, 3) m around the body: one for all, or one that goes along."""
    body = np.ptp(boxes, axis=1).max(axis=0)
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    follows = bool(((high - low)[:2] > FAR * max(body.max(), 1e-9)).any())
    middle = boxes.mean(axis=1) if follows else np.tile(0.5 * (low + high), (len(boxes), 1))
    middle[:, 2] = 0.5 * (low + high)[2]
    extent = np.array([*(body if follows else high - low)[:2], (high - low)[2]])
    # the diagonal of the floor plan is the widest that can be seen
    height = AROUND * float(max(np.hypot(extent[0], extent[1]) * SIZE[1] / SIZE[0], extent[2] + 0.5 * extent[:2].max()))
    return [View(target, max(height, 1e-6), SIZE, height / TILES) for target in middle]


def _captioned(picture: Picture, caption: str, notes: Sequence[str]) -> Picture:
    image = Image.fromarray(picture)
    pen, font = ImageDraw.Draw(image), ImageFont.load_default(FONT)
    pen.text((12, SIZE[1] - 2 * FONT), caption, INK, font)
    lines = [line for note in notes for line in textwrap.wrap(note, LINE)]
    pen.multiline_text((12, 10), "\n".join(lines), WARNING, font)
    return np.asarray(image)
