"""A small room around a ball, in flat splats: floorboards, two walls, a window and sunlight through it.

Metres, z up, the ball on the floor at the origin. Light is baked into the colours, as in a capture.
"""

import numpy as np

from odeform.types import Floats, Perpoint, Points
from odeform_figures.splats.surfels import Surfels, grid, joined_surfels, tiles

__all__ = ["room"]

LOW, HIGH = np.array([-1.0, -1.2]), np.array([2.0, 1.2])  # the floor; walls stand at both high ends
HEIGHT = 1.15  # of the walls
PLANK = np.array([0.9, 0.12])
SKIRTING = 0.07
PANE = (0.45, 1.15, 0.16, 0.98)  # the window in the left wall: from x to x, from z to z
BAR = 0.014  # half the width of one
SUN = np.array([0.32, -1.0, -0.95])  # direction of the light
X, Y, Z = np.eye(3)

OAK = np.array([0.71, 0.51, 0.33])
PLASTER = np.array([0.93, 0.90, 0.84])
GREEN = np.array([0.56, 0.66, 0.62])
WHITE = np.array([0.96, 0.95, 0.92])
SKY = np.array([0.80, 0.90, 0.98])
LAWN = np.array([0.46, 0.72, 0.52])
DAY, SUNSHINE = 0.92, np.array([0.52, 0.47, 0.36])


def room(radius: float, rng: np.random.Generator) -> Surfels:
    """Makes the room, with a finer floor around a ball of `radius` m. No shadow is baked: it would stay."""
    return joined_surfels([_floor(radius, rng), *_walls(), _window(), *_skirting()])


def _step(values: Floats) -> Floats:
    """Smooth step from 0 to 1 around 0, about one unit wide."""
    return 0.5 * (1.0 + np.tanh(2.0 * values))


def _corner(distance: Floats) -> Floats:
    """Fraction of the light that is left `distance` m from an edge between two surfaces."""
    return 1.0 - 0.34 * np.exp(-distance / 0.10) - 0.10 * np.exp(-distance / 0.45)


def _glass(x: Floats, z: Floats, blur: Floats | float) -> Perpoint:
    """Transparency from 0 to 1 on the left wall: panes between the frame and its bars."""
    left, right, low, high = PANE
    out = _step((x - left) / blur) * _step((right - x) / blur) * _step((z - low) / blur) * _step((high - z) / blur)
    for value, fraction, start, stop in ((x, 0.5, left, right), (z, 0.38, low, high), (z, 0.76, low, high)):
        out = out * _step((np.abs(value - start - fraction * (stop - start)) - BAR) / blur)
    return out


def _sunlit(x: Floats, y: Floats) -> Perpoint:
    """Sunlight from 0 to 1 on the floor, softer the farther from the window."""
    path = (HIGH[1] - y) / -SUN[1]
    return _glass(x - path * SUN[0], -path * SUN[2], 0.006 + 0.012 * path)


def _floor(radius: float, rng: np.random.Generator) -> Surfels:
    """Long narrow splats, which look like wood grain."""
    rows = np.arange(LOW[1] + 0.005, HIGH[1], 0.01)
    x, y = grid(np.arange(LOW[0] + 0.03, HIGH[0], 0.06), rows)
    # finer where light changes
    fine = (np.hypot(x, y) < 3.6 * radius) | (np.abs(_sunlit(x, y) - 0.5) < 0.4999)
    parts = 6 * int(fine.sum())
    length = np.concatenate([np.full((~fine).sum(), 0.06), np.full(parts, 0.02)])
    width = np.concatenate([np.full((~fine).sum(), 0.01), np.full(parts, 0.005)])
    aside, beside = grid(np.array([-0.02, 0.0, 0.02]), np.array([-0.0025, 0.0025]))
    x = np.concatenate([x[~fine], (x[fine, None] + aside).ravel()])
    y = np.concatenate([y[~fine], (y[fine, None] + beside).ravel()])
    pitch = np.stack([length, width], axis=1)
    # a little below the ball, so that no region around it contains any of the floor
    wood = OAK * _boards(x, y, rng)
    return tiles(-1e-3 * Z, X, Y, np.stack([x, y], axis=1), pitch, wood * _floor_light(x, y))


def _boards(x: Floats, y: Floats, rng: np.random.Generator) -> Points:
    """(N, 3) color factors: a tone per board, a grain per row of splats, and darker edges."""
    lane = np.floor((y - LOW[1]) / PLANK[1]).astype(int)
    row = np.floor((y - LOW[1]) / 0.01).astype(int)
    along = x - LOW[0] + PLANK[0] * rng.random(lane.max() + 1)[lane]
    board = np.floor(along / PLANK[0]).astype(int)
    tone = 0.86 + 0.24 * rng.random((lane.max() + 1, board.max() + 1))[lane, board]
    warmth = 0.08 * (rng.random((lane.max() + 1, board.max() + 1))[lane, board] - 0.5)
    grain = 1.0 + 0.10 * (rng.random((row.max() + 1, board.max() + 1))[row, board] - 0.5)
    grain = grain + 0.05 * (rng.random(len(x)) - 0.5)
    side, end = (
        np.abs(np.mod(value + 0.5 * size, size) - 0.5 * size)
        for value, size in ((y - LOW[1], PLANK[1]), (along, PLANK[0]))
    )
    edge = np.where((side < 0.003) | (end < 0.011), 0.66, 1.0)
    return (tone * grain * edge)[:, None] * (1.0 + warmth[:, None] * np.array([1.0, 0.2, -1.5]))


def _floor_light(x: Floats, y: Floats) -> Points:
    """(N, 3) color factors: darker corners, and sunlight."""
    even = _corner(HIGH[0] - x) * _corner(HIGH[1] - y)
    return DAY * even[:, None] + SUNSHINE * _sunlit(x, y)[:, None]


def _walls() -> list[Surfels]:
    back, left = HIGH - LOW
    a, z = grid(np.arange(0.015, left, 0.03), np.arange(SKIRTING + 0.015, HEIGHT, 0.03))
    hole = (np.abs(a + LOW[0] - 0.5 * sum(PANE[:2])) < 0.5 * (PANE[1] - PANE[0]) + 0.06) & (
        np.abs(z - 0.5 * sum(PANE[2:])) < 0.5 * (PANE[3] - PANE[2]) + 0.06
    )
    a, z = a[~hole], z[~hole]
    beside = _wall(np.array([LOW[0], HIGH[1], 0.0]), X, a, z, PLASTER * _wall_light(left - a, z)[:, None])
    a, z = grid(np.arange(0.015, back, 0.03), np.arange(SKIRTING + 0.015, HEIGHT, 0.03))
    # light from the window on the wall beside it
    glow = 0.10 * np.exp(-(((back - a - 0.75) / 0.7) ** 2))
    behind = _wall(np.array([HIGH[0], LOW[1], 0.0]), Y, a, z, GREEN * (_wall_light(back - a, z) + glow)[:, None])
    return [beside, behind]


def _wall(corner: Floats, along: Floats, a: Floats, z: Floats, colors: Points) -> Surfels:
    return tiles(corner, along, Z, np.stack([a, z], axis=1), np.array([0.03, 0.03]), colors, cover=0.85)


def _wall_light(from_corner: Floats, z: Floats) -> Perpoint:
    return _corner(z) * _corner(from_corner) * (0.94 + 0.06 * z / HEIGHT)


def _window() -> Surfels:
    """Panes and their frame, in fine tiles for sharp edges."""
    left, right, low, high = PANE
    x, z = grid(np.arange(left - 0.08, right + 0.08, 0.012), np.arange(low - 0.08, high + 0.08, 0.012))
    beyond = (x < left - 0.05) | (x > right + 0.05) | (z < low - 0.05) | (z > high + 0.05)
    frame = np.where(beyond[:, None], PLASTER * _wall_light(HIGH[0] - x, z)[:, None], WHITE)
    height = (z - low) / (high - low)
    sky = _step((height - 0.32) / 0.14)[:, None]
    outside = (SKY + 0.12 * height[:, None]) * sky + LAWN * (1.0 - sky)
    glass = _glass(x, z, 0.004)[:, None]
    at, pitch = np.stack([x, z], axis=1), np.array([0.012, 0.012])
    return tiles(np.array([0.0, HIGH[1] - 2e-3, 0.0]), X, Z, at, pitch, frame * (1.0 - glass) + outside * glass)


def _skirting() -> list[Surfels]:
    out = []
    for corner, along, length in (
        (np.array([HIGH[0] - 0.012, LOW[1], 0.0]), Y, HIGH[1] - LOW[1]),
        (np.array([LOW[0], HIGH[1] - 0.012, 0.0]), X, HIGH[0] - LOW[0]),
    ):
        a, z = grid(np.arange(0.02, length, 0.04), np.arange(0.004, SKIRTING + 0.008, 0.008))
        light = (0.72 + 0.28 * _step((z - 0.012) / 0.012)) * _corner(length - a) * np.where(z > SKIRTING, 1.05, 1.0)
        at, pitch = np.stack([a, z], axis=1), np.array([0.04, 0.008])
        out.append(tiles(corner, along, Z, at, pitch, WHITE * light[:, None]))
    return out
