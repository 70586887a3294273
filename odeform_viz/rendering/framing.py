"""Places columns and camera so that each body is whole, unobscured and seen from the same angle.

Columns stand on a grid in the plane of the view. A long lens far away shows each of them from nearly one direction.
"""

import math
from dataclasses import dataclass

import numpy as np

from odeform.types import Floats, Vector

__all__ = ["Axes", "Box", "Camera", "Framing", "Viewport", "frame_columns", "free_area"]

Viewport = tuple[int, int]
"""Width and height of a browser's canvas, in px."""

ELEVATION = math.radians(22.0)  # of the camera above the floor
AZIMUTH = math.radians(213.7)  # of the camera around bodies on which nothing acts
ASIDE = math.radians(35.0)  # between the plane of the view and what acts: seen from the side, its tail in front
ALONE, SEVERAL = 0.35, 0.16  # rad; vertical field of view for one place and for a grid
STAGE = 0.72  # radius of the floor under each of several columns, in sizes of the body
SIDE, BOTTOM, TOP, EDGE = 350, 262, 100, 16  # px covered by the panels, and left free around everything
NOTED = 36  # px that one more line of text over the scene takes
PHONE = 768  # px; narrower pages have their panel at the bottom
PHONE_TOP, PHONE_BOTTOM = 96, 200  # px there
TITLE = 46  # px below each of several columns, for two lines
FILL = {True: 0.92, False: 0.95}  # of the free area that is used, for one place (in perspective) and for several
GAP = 1.08  # from the middle of a floor to the next at least, in diameters
SPREAD = 1.5  # largest distance between columns, in widths of a column
LEVEL = 0.3  # of what acts: less of it along the floor gives the view no direction


@dataclass(frozen=True, eq=False)
class Axes:
    """Unit vectors (3,) of a view: to the right, upwards in the picture, and from the bodies to the camera."""

    right: Vector
    above: Vector
    direction: Vector

    @classmethod
    def at(cls, azimuth: float) -> "Axes":
        """The camera stands at `azimuth` rad around the bodies."""
        along = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
        direction = math.cos(ELEVATION) * along + math.sin(ELEVATION) * np.array([0.0, 0.0, 1.0])
        right = np.array([-along[1], along[0], 0.0])
        return cls(right, np.cross(direction, right), direction)

    @classmethod
    def beside(cls, acting: Vector | None) -> "Axes":
        """What acts along (3,) goes from left to right, and a little away from the camera."""
        if acting is None or np.hypot(*acting[:2]) <= LEVEL * np.linalg.norm(acting):
            return cls.at(AZIMUTH)
        return cls.at(math.atan2(acting[1], acting[0]) - 0.5 * math.pi - ASIDE)

    @property
    def rise(self) -> float:
        """Metres in the picture of a metre on the floor away from the camera."""
        return float(np.hypot(*self.above[:2]))


@dataclass(frozen=True)
class Box:
    """What a body covers in the plane of the view, in m from its scene's origin."""

    left: float
    right: float
    low: float
    high: float

    def around(self, radius: float, axes: Axes) -> "Box":
        """The same with a round floor of that radius in m, and its gap to the next."""
        across, deep = GAP * radius, radius * axes.rise
        return Box(min(self.left, -across), max(self.right, across), min(self.low, -deep), max(self.high, deep))


@dataclass(frozen=True, eq=False)
class Camera:
    """Describes a browser's camera: positions (3,) in m, and the vertical field of view in rad."""

    position: Vector
    look_at: Vector
    fov: float


@dataclass(frozen=True, eq=False)
class Framing:
    """Places of the columns, and the cameras that show them."""

    axes: Axes
    offsets: tuple[Vector, ...]
    """(3,) m for each column: where its scene's origin is."""
    middle: Vector
    """(3,) m: what is in the middle of the free area."""
    span: tuple[float, float]
    """Width and height in m, in the plane of the view, that have to be visible."""
    title: Vector
    """(3,) m from an offset to the top centre of the column's title."""
    title_pixels: float
    """Width that is free for a title, in px."""
    stage: float
    """Radius in m of the floor under each column."""
    noted: bool = False
    """Whether one more line of text lies over the scene."""

    def camera(self, viewport: Viewport) -> Camera:
        """The camera of a browser of that size: all columns are within its free area."""
        left, top, right, bottom = free_area(viewport, self.noted)
        alone = len({tuple(offset) for offset in self.offsets}) == 1
        free = FILL[alone] * np.array([right - left, bottom - top])
        pixels = max(float((free / self.span).min()), 1e-3)  # per metre
        # the middle of the free area, right of and above the middle of the picture
        aside = np.array([0.5 * (left + right - viewport[0]), 0.5 * (viewport[1] - top - bottom)]) / pixels
        look_at = self.middle - aside[0] * self.axes.right - aside[1] * self.axes.above
        fov = ALONE if alone else SEVERAL
        distance = viewport[1] / pixels / (2.0 * math.tan(0.5 * fov))
        return Camera(look_at + distance * self.axes.direction, look_at, fov)


def free_area(viewport: Viewport, noted: bool = False) -> tuple[float, float, float, float]:
    """Left, top, right and bottom, in px, of what panels leave free in a page of that size; less of it where it is
    `noted` that something is wrong with what is in view."""
    width, height = viewport
    more = NOTED if noted else 0
    if width < PHONE:
        return (EDGE, PHONE_TOP + more, width - EDGE, max(height - PHONE_BOTTOM, 0.5 * height))
    return (EDGE, TOP + more, width - SIDE, max(height - BOTTOM, 0.4 * height))


def frame_columns(
    count: int,
    axes: Axes,
    body: Box,
    extent: float,
    viewport: Viewport,
    together: bool,
    level: bool,
    noted: bool = False,
    reach: float = 0.0,
) -> Framing:
    """Place `count` bodies of `extent` m, each of which covers `body`, for a browser of size `viewport`.

    `together` puts all in one place; `level` keeps several on one floor, in one row; see `free_area` for `noted`.
    What moves on a floor of its own gets `reach` m away from the middle of it, at most.
    """
    left, top, right, bottom = free_area(viewport, noted)
    places = 1 if together else count
    alone = places == 1
    stage = max(STAGE * extent, reach)
    box = body if alone else body.around(stage, axes)
    wide, tall, strip = box.right - box.left, box.high - box.low, 0 if alone else TITLE
    free = FILL[alone] * np.array([right - left, bottom - top])

    def scale(rows: int) -> float:
        columns = math.ceil(places / rows)
        return min(free[0] / (columns * wide), (free[1] - rows * strip) / (rows * tall))

    rows = 1 if level else max(range(1, places + 1), key=scale)
    pixels = max(scale(rows), 1e-3)  # per metre
    columns = math.ceil(places / rows)
    pitch = min(free[0] / columns / pixels, SPREAD * wide)
    step = min(free[1] / rows / pixels, SPREAD * (tall + strip / pixels))
    across, upwards = 0.5 * (box.left + box.right), 0.5 * (box.low + box.high) - 0.5 * strip / pixels
    middle = across * axes.right + upwards * axes.above
    offsets = [_cell(index, places, columns, rows, pitch, step, axes) for index in range(places)]
    if not (alone or level):
        offsets = [offset - middle for offset in offsets]
    span = (wide, tall) if alone else (columns * pitch, rows * step)
    looked_at = middle if alone or level else np.zeros(3)
    title = across * axes.right + box.low * axes.above
    places_of = tuple(offsets * (count if together else 1))
    return Framing(axes, places_of, looked_at, span, title, pitch * pixels, stage, noted)


def _cell(index: int, places: int, columns: int, rows: int, pitch: float, step: float, axes: Axes) -> Floats:
    """(3,) m from the middle of the grid to one of its cells; an incomplete last row is centred."""
    row, column = divmod(index, columns)
    in_row = min(columns, places - row * columns)
    aside, upwards = (column - 0.5 * (in_row - 1)) * pitch, (0.5 * (rows - 1) - row) * step
    return aside * axes.right + upwards * axes.above
