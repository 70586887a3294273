"""Colors of models, of the truth and of errors, shared by the page and by recordings."""

import numpy as np

from odeform_viz.columns import Column

__all__ = [
    "ACTING",
    "BACKGROUND",
    "CLAY",
    "CONTACT",
    "HANDLE",
    "MODELS",
    "SPHERE",
    "TRUTH",
    "Color",
    "color_of",
    "darker",
    "paler",
]

Color = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""

MODELS: tuple[Color, ...] = (
    (30, 92, 190),
    (0, 148, 108),
    (170, 68, 153),
    (206, 78, 26),
    (230, 159, 0),
    (130, 185, 225),
    (105, 66, 30),
    (205, 190, 90),
)
"""Any two of these and of the truth's differ by at least 17 in CIELAB, also for color-blind readers."""
TRUTH: Color = (70, 74, 82)
BACKGROUND: Color = (188, 190, 186)
"""The part of a scene that does not move."""
RANKS: tuple[Color, ...] = ((46, 5, 149), (127, 3, 167), (190, 50, 119), (229, 107, 92), (251, 167, 56))
"""Ordered colors, of equal perceptual steps (plasma): for columns that differ in one ordered parameter."""
CLAY: Color = (226, 214, 199)
"""The material of bodies without colors of their own."""
ACTING: Color = (60, 66, 78)
"""What acts and cannot be dragged."""
CONTACT: Color = (20, 20, 24)
"""The marker where a sphere touches a body."""
SPHERE: Color = (150, 156, 166)
"""The sphere that pushes a body."""
HANDLE: Color = (214, 96, 48)
"""Colors what the user drags, and is the brand color of the page."""


def color_of(column: Column) -> Color:
    """The color of a column: a model has one of its own, or that of its rank; the truth is gray."""
    if column.truth:
        return TRUTH
    return MODELS[column.color_index % len(MODELS)] if column.rank is None else _ranked(column.rank)


def _ranked(rank: float) -> Color:
    red, green, blue = (
        round(float(np.interp(rank * (len(RANKS) - 1), range(len(RANKS)), channel)))
        for channel in zip(*RANKS, strict=True)
    )
    return red, green, blue


def darker(color: Color) -> Color:
    """The second color of a checkerboard: a body of one color hides its rotation."""
    red, green, blue = (round(0.84 * channel) for channel in color)
    return red, green, blue


def paler(color: Color) -> Color:
    """Returns a color mixed with white, for what has passed."""
    red, green, blue = (round(0.45 * channel + 0.55 * 235) for channel in color)
    return red, green, blue
