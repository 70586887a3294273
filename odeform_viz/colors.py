"""Colors of models, of the truth and of errors, shared by the page and by recordings."""

from odeform_viz.columns import Column

__all__ = ["ARROW", "BACKGROUND", "HANDLE", "MODELS", "TRUTH", "Color", "color_of", "paler"]

Color = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""

MODELS: tuple[Color, ...] = (
    (206, 78, 26),
    (30, 92, 190),
    (48, 132, 66),
    (126, 66, 172),
    (176, 42, 98),
    (0, 128, 140),
)
TRUTH: Color = (70, 74, 82)
BACKGROUND: Color = (188, 190, 186)
"""The part of a scene that does not move."""
ARROW: Color = (190, 20, 20)
HANDLE: Color = (214, 96, 48)
"""What the user drags, and the brand color of the page."""


def color_of(column: Column) -> Color:
    """The color of a column: a model has one of its own, the truth is gray."""
    return TRUTH if column.truth else MODELS[column.color_index % len(MODELS)]


def paler(color: Color) -> Color:
    """The second color of a checkerboard: a body of one color hides its rotation."""
    red, green, blue = (round(0.45 * channel + 0.55 * 235) for channel in color)
    return red, green, blue
