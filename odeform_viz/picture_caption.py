"""Writes below a picture of the viewport what the page says over it: subject, time, and the scale of the colours."""

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from odeform.formats.picture_files import Picture
from odeform_viz.coloring.scale import colors_of
from odeform_viz.rendering.framing import Viewport, free_area
from odeform_viz.view import ColorScale

__all__ = ["captioned", "cropped_to_view"]

LINES, FONT, EDGE = 2, 14, 10  # rows of text, px of a letter and of the margin, at a width of 720 px
USUAL = 720  # px
SMALLEST = 40  # px; a page that leaves less free is shown whole
BAR = 0.36  # of the width
INK, PAPER = (40, 40, 44), (255, 255, 255)


def cropped_to_view(picture: Picture, viewport: Viewport) -> Picture:
    """The part (H, W, 3) of a picture of a page of that size that no panel covers: what is framed is in its middle."""
    scale = picture.shape[1] / viewport[0]
    left, top, right, bottom = (round(scale * edge) for edge in free_area(viewport))
    if right - left < SMALLEST or bottom - top < SMALLEST:
        return picture
    return picture[top:bottom, left:right]


def captioned(picture: Picture, subject: str, time: float, scale: ColorScale | None) -> Picture:
    """The picture (H, W, 3) with a strip below: `subject`, `time` in s, and the colours if they show a quantity."""
    width = picture.shape[1]
    unit = max(width / USUAL, 0.5)
    font, edge = ImageFont.load_default(FONT * unit), round(EDGE * unit)
    row = round(1.35 * FONT * unit)
    strip = Image.new("RGB", (width, LINES * row + 2 * edge), PAPER)
    case = ImageDraw.Draw(strip)
    free = width - 2 * edge - (round(BAR * width) + edge if scale else 0)
    case.text((edge, edge), _shortened(subject, free, font), INK, font)
    case.text((edge, edge + row), f"t = {time:.3f} s", INK, font)
    if scale is not None:
        _draw_bar(strip, scale, (width - edge - round(BAR * width), edge, round(BAR * width), row), font)
    return np.concatenate([picture, np.asarray(strip)])


def _shortened(text: str, most: float, font: ImageFont.FreeTypeFont | ImageFont.ImageFont) -> str:
    """A text of at most `most` px; of a longer one the end is left out."""
    while text and font.getlength(text) > most:
        text = f"{text.removesuffix('…')[:-1]}…" if len(text) > 2 else ""
    return text


def _draw_bar(
    strip: Image.Image,
    scale: ColorScale,
    place: tuple[int, int, int, int],
    font: ImageFont.FreeTypeFont | ImageFont.ImageFont,
) -> None:
    """A bar of the colours at (x, y, width, height of a row), with its ends and its quantity below."""
    x, y, width, row = place
    colors = colors_of(np.linspace(0.0, scale.top, width), scale)
    bar = Image.fromarray(np.tile(colors[None], (max(row * 3 // 5, 1), 1, 1)))
    strip.paste(bar, (x, y + row // 5))
    case = ImageDraw.Draw(strip)
    case.text((x, y + row), "0", INK, font)
    case.text((x + width, y + row), f"{scale.top:g} {scale.unit}", INK, font, anchor="ra")
    case.text((x + width // 2, y + row), scale.quantity, INK, font, anchor="ma")
