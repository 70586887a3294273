"""Colors of models, of the truth and of errors, shared by the page and by recordings."""

from odeform_viz.columns import Column

__all__ = ["ARROW", "BACKGROUND", "CONTACT", "HANDLE", "MODELS", "SPHERE", "TRUTH", "Color", "color_of", "paler"]

Color = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""

MODELS: tuple[Color, ...] = (
    (206, 78, 26),
    (30, 92, 190),
    (0, 148, 108),
    (170, 68, 153),
    (230, 159, 0),
    (130, 185, 225),
    (105, 66, 30),
    (205, 190, 90),
)
"""Any two of these and of the truth's differ by at least 17 in CIELAB, also for color-blind readers."""
TRUTH: Color = (70, 74, 82)
BACKGROUND: Color = (188, 190, 186)
"""The part of a scene that does not move."""
ARROW: Color = (190, 20, 20)
CONTACT: Color = (20, 20, 24)
"""The marker where a sphere touches a body."""
SPHERE: Color = (150, 156, 166)
"""The sphere that pushes a body."""
HANDLE: Color = (214, 96, 48)
"""Colors what the user drags, and is the brand color of the page."""


def color_of(column: Column) -> Color:
    """The color of a column: a model has one of its own, the truth is gray."""
    return TRUTH if column.truth else MODELS[column.color_index % len(MODELS)]


def paler(color: Color) -> Color:
    """Returns the second color of a checkerboard: a body of one color hides its rotation."""
    red, green, blue = (round(0.45 * channel + 0.55 * 235) for channel in color)
    return red, green, blue
