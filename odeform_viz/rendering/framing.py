"""Places columns and camera so that each body is whole, unobscured and seen from the same angle.

Columns stand on a grid in the plane of the view. A long lens far away shows each of them from nearly one direction.
"""

import math
from dataclasses import dataclass

import numpy as np

from odeform.types import Floats, Vector

__all__ = ["Camera", "Framing", "Viewport", "frame_columns", "free_area"]

Viewport = tuple[int, int]
"""Width and height of a browser's canvas, in px."""

DIRECTION = np.array([-3.9, -2.6, 1.9]) / np.linalg.norm([-3.9, -2.6, 1.9])  # from the bodies to the camera
TOWARDS, UP = -DIRECTION, np.array([0.0, 0.0, 1.0])
RIGHT = np.cross(TOWARDS, UP) / np.linalg.norm(np.cross(TOWARDS, UP))
ABOVE = np.cross(RIGHT, TOWARDS)  # up in the picture
RISE = float(np.hypot(ABOVE[0], ABOVE[1]))  # of a metre on the floor away from the camera, in the picture
ALONE, SEVERAL = 0.6, 0.16  # rad; vertical field of view for one place and for a grid
STAGE = 0.72  # radius of the floor under each of several columns, in sizes of the body
SIDE, BOTTOM, TOP, EDGE = 350, 210, 16, 16  # px covered by the panels, and left free around everything
PHONE = 768  # px; narrower pages have their panel at the bottom
TITLE = 46  # px below each of several columns, for two lines
FILL = {True: 0.72, False: 0.95}  # of the free area that is used, for one place (in perspective) and for several
GAP = 1.08  # from the middle of a floor to the next at least, in diameters
SPREAD = 1.5  # largest distance between columns, in widths of a column


@dataclass(frozen=True, eq=False)
class Camera:
    """Describes a browser's camera: positions (3,) in m, and the vertical field of view in rad."""

    position: Vector
    look_at: Vector
    fov: float


@dataclass(frozen=True, eq=False)
class Framing:
    """Places of the columns, and the cameras that show them."""

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

    def camera(self, viewport: Viewport) -> Camera:
        """The camera of a browser of that size: all columns are within its free area."""
        left, top, right, bottom = free_area(viewport)
        alone = len({tuple(offset) for offset in self.offsets}) == 1
        free = FILL[alone] * np.array([right - left, bottom - top])
        pixels = max(float((free / self.span).min()), 1e-3)  # per metre
        # the middle of the free area, right of and above the middle of the picture
        aside = np.array([0.5 * (left + right - viewport[0]), 0.5 * (viewport[1] - top - bottom)]) / pixels
        look_at = self.middle - aside[0] * RIGHT - aside[1] * ABOVE
        fov = ALONE if alone else SEVERAL
        distance = viewport[1] / pixels / (2.0 * math.tan(0.5 * fov))
        return Camera(look_at + distance * DIRECTION, look_at, fov)


def free_area(viewport: Viewport) -> tuple[float, float, float, float]:
    """Left, top, right and bottom, in px, of what panels leave free in a page of that size."""
    width, height = viewport
    if width < PHONE:
        return (EDGE, EDGE, width - EDGE, 0.5 * height)
    return (EDGE, TOP, width - SIDE, height - BOTTOM)


def frame_columns(count: int, extent: float, height: float, viewport: Viewport, together: bool, level: bool) -> Framing:
    """Place `count` bodies of `extent` m that rise to `height` m above the floor, for a browser of size `viewport`.

    `together` puts all in one place; `level` keeps several on one floor, in one row.
    """
    left, top, right, bottom = free_area(viewport)
    places = 1 if together else count
    alone = places == 1
    stage = STAGE * extent
    low, high = -stage * RISE, height * float(ABOVE[2]) + 0.5 * extent * RISE
    wide, tall, strip = GAP * 2.0 * stage, high - low, 0 if alone else TITLE
    free = FILL[alone] * np.array([right - left, bottom - top])

    def scale(rows: int) -> float:
        columns = math.ceil(places / rows)
        return min(free[0] / (columns * wide), (free[1] - rows * strip) / (rows * tall))

    rows = 1 if level else max(range(1, places + 1), key=scale)
    pixels = max(scale(rows), 1e-3)  # per metre
    columns = math.ceil(places / rows)
    pitch = min(free[0] / columns / pixels, SPREAD * wide)
    step = min(free[1] / rows / pixels, SPREAD * (tall + strip / pixels))
    middle = 0.5 * (low + high) - 0.5 * strip / pixels
    offsets = [_cell(index, places, columns, rows, pitch, step) for index in range(places)]
    if not (alone or level):
        offsets = [offset - middle * ABOVE for offset in offsets]
    looked_at = (middle if alone or level else 0.0) * ABOVE
    span = (wide, tall) if alone else (columns * pitch, rows * step)
    return Framing(tuple(offsets * (count if together else 1)), looked_at, span, low * ABOVE, pitch * pixels, stage)


def _cell(index: int, places: int, columns: int, rows: int, pitch: float, step: float) -> Floats:
    """(3,) m from the middle of the grid to one of its cells; an incomplete last row is centred."""
    row, column = divmod(index, columns)
    in_row = min(columns, places - row * columns)
    return (column - 0.5 * (in_row - 1)) * pitch * RIGHT + (0.5 * (rows - 1) - row) * step * ABOVE
