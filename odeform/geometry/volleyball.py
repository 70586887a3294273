"""A volleyball in a small room, as Gaussian splats: `python -m odeform.geometry.volleyball --out volleyball.spz`.

The ball is as large as those that models are trained on. Light is baked into the colours, as a capture has it: that of
a window, corners that get less of it, and the shadow where the ball touches the floor.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

from odeform.files import write_aside
from odeform.geometry.bundled import region_beside
from odeform.geometry.region import Sphere, region_to_json
from odeform.geometry.similarity import UPRIGHT, Similarity
from odeform.geometry.splat_spz import spz_bytes
from odeform.geometry.surfels import Surfels, sphere_surfels, splats_of, tiles
from odeform.types import Floats, GaussianSplats, Perpoint, Points

__all__ = ["REGION", "main", "volleyball_in_room"]

RADIUS = 0.1  # m
PANELS = np.array([[0.96, 0.76, 0.10], [0.93, 0.92, 0.88], [0.11, 0.27, 0.60]])  # yellow, white, blue
SEAM = 1.3e-3  # m, half the width of a groove

LOW, HIGH = np.array([-1.0, -1.2]), np.array([2.0, 1.2])  # m, the floor; walls stand at both high ends
WALL = 1.15  # m high
PLANK = 0.12  # m wide
BOARD = 0.07  # m, height of the skirting board
PANE = (0.45, 1.15, 0.16, 0.98)  # m, the window in the left wall: from x to x, from z to z
SUN = np.array([0.32, -1.0, -0.95])

OAK = np.array([0.71, 0.51, 0.33])
PLASTER = np.array([0.93, 0.90, 0.84])
GREEN = np.array([0.56, 0.66, 0.62])
WHITE = np.array([0.96, 0.95, 0.92])
SKY = np.array([0.80, 0.90, 0.98])

REGION = Sphere(np.array([0.0, 0.0, 0.105]), 0.1052)
"""Round the ball, in metres with z up; it touches the floor from above, of which it holds nothing."""
FILE = Similarity(rotation=UPRIGHT["-y"].T)  # from z up to the axes of captures: y down, z forward


def volleyball_in_room() -> GaussianSplats:
    """The scene in metres, z up, the ball on the floor at the origin. The same whenever it is made."""
    rng = np.random.default_rng(7)
    return splats_of([_ball(), *_floor(rng), *_walls(), *_window(), *_skirting()])


Part = tuple[Surfels, Points, Perpoint]


def _part(surfels: Surfels, colors: Points) -> Part:
    return surfels, colors, np.ones(len(colors))


def _ball() -> Part:
    # a little inside, so that the floor stays below
    surfels = sphere_surfels(np.array([0.0, 0.0, RADIUS]), RADIUS - 5e-4, 24_000)
    normals = (surfels.points - [0.0, 0.0, RADIUS]) / (RADIUS - 5e-4)
    turned = normals @ _turn(0.5, 0.35).T
    panel, away = _panels(turned)
    puffed = 0.90 + 0.10 * (1.0 - np.exp(-((away / 6e-3) ** 2)))  # panels fall off towards their seams
    groove = 0.42 + 0.58 * _step((away - SEAM) / 8e-4)
    light = 0.88 + 0.12 * normals @ np.array([0.05, 0.45, 0.89])
    return _part(surfels, PANELS[panel] * (puffed * groove * light)[:, None])


def _panels(directions: Points) -> tuple[np.ndarray, Perpoint]:
    """For unit vectors (N, 3), which of three panels of one of six groups, and the metres to the nearest seam.

    The groups lie as the faces of a cube, the panels of each across those of its neighbours.
    """
    axis = np.abs(directions).argmax(axis=1)
    rows = np.arange(len(directions))
    depth = np.abs(directions[rows, axis])
    # equal steps are equal angles
    across = np.arctan2(directions[rows, (axis + 1) % 3], depth) * 4.0 / np.pi
    along = np.arctan2(directions[rows, (axis + 2) % 3], depth) * 4.0 / np.pi
    panel = np.clip(((across + 1.0) * 1.5).astype(int), 0, 2)
    to_panel = np.abs(np.abs(across) - 1.0 / 3.0)
    to_group = 1.0 - np.maximum(np.abs(across), np.abs(along))
    return panel, np.minimum(to_panel, to_group) * 0.25 * np.pi * RADIUS


def _turn(about_z: float, about_x: float) -> Floats:
    from odeform.geometry.rigid import rotation_from_vector, rotation_z

    return rotation_from_vector(np.array([about_x, 0.0, 0.0])) @ rotation_z(about_z)


def _step(values: Floats) -> Floats:
    """From 0 to 1 around 0, over about one unit."""
    return 0.5 * (1.0 + np.tanh(2.0 * values))


def _corner(distance: Floats) -> Floats:
    """The light that is left so many metres from where two surfaces meet."""
    return 1.0 - 0.34 * np.exp(-distance / 0.10) - 0.10 * np.exp(-distance / 0.45)


def _sunlit(x: Floats, y: Floats) -> Floats:
    """(N,) from 0 to 1: where on the floor the sun falls in, softer the longer its way."""
    fall = (HIGH[1] - y) / -SUN[1]
    return _pane(x - fall * SUN[0], -fall * SUN[2], 0.006 + 0.012 * fall)


def _pane(x: Floats, z: Floats, blur: Floats | float) -> Floats:
    """(N,) from 0 to 1: glass at places of the left wall, between the frame and its two bars."""
    left, right, low, high = PANE
    out = _step((x - left) / blur) * _step((right - x) / blur) * _step((z - low) / blur) * _step((high - z) / blur)
    for place, bar in ((x, 0.5 * (left + right)), (z, 0.62 * low + 0.38 * high), (z, 0.24 * low + 0.76 * high)):
        out = out * _step((np.abs(place - bar) - 0.014) / blur)
    return out


def _floor(rng: np.random.Generator) -> list[Part]:
    rows = np.arange(LOW[1] + 0.005, HIGH[1], 0.01)
    plank = np.floor((rows - LOW[1]) / PLANK + 1e-9).astype(int)
    x, y = (part.ravel() for part in np.meshgrid(np.arange(LOW[0] + 0.03, HIGH[0], 0.06), rows))
    near = (np.hypot(x, y) < 0.36) | (np.abs(_sunlit(x, y) - 0.5) < 0.4999)
    x, y = x[near], y[near]
    thirds = (x[:, None] + [-0.02, 0.0, 0.02]).ravel(), np.repeat(y, 3)
    whole_x, whole_y = (part.ravel() for part in np.meshgrid(np.arange(LOW[0] + 0.03, HIGH[0], 0.06), rows))
    x, y = np.concatenate([whole_x[~near], thirds[0]]), np.concatenate([whole_y[~near], thirds[1]])
    length = np.where(np.arange(len(x)) < (~near).sum(), 0.06, 0.02)
    # staggered rows look like grain, not like tiles; not where edges of light are to be straight
    row = np.rint((y - rows[0]) / 0.01).astype(int)
    x = x + np.where(length > 0.03, 0.05 * (rng.random(len(rows))[row] - 0.5), 0.0)
    x = np.clip(x, LOW[0] + 0.5 * length, HIGH[0] - 0.5 * length)
    at = plank[row]
    start = 0.9 * rng.random(at.max() + 1)[at]
    board = np.floor((x - LOW[0] + start) / 0.9).astype(int)
    tone = 0.86 + 0.24 * rng.random((at.max() + 1, board.max() + 1))[at, board]
    warm = 0.05 * (rng.random((at.max() + 1, board.max() + 1))[at, board] - 0.5)
    grain = (
        1.0 + 0.10 * (rng.random((len(rows), board.max() + 1))[row, board] - 0.5) + 0.05 * (rng.random(len(x)) - 0.5)
    )
    edge = np.abs(np.mod(y - LOW[1] + 0.5 * PLANK, PLANK) - 0.5 * PLANK)
    end = np.abs(np.mod(x - LOW[0] + start + 0.45, 0.9) - 0.45)
    wood = OAK * (tone * grain)[:, None] + warm[:, None] * np.array([1.0, 0.2, -0.8])
    wood = wood * np.where((edge < 0.006) | (end < 0.011), 0.80, 1.0)[:, None]
    pitch = np.stack([length, np.full(len(x), 0.01)], axis=1)
    surfels = tiles(np.array([0.0, 0.0, -1e-3]), np.eye(3)[0], np.eye(3)[1], np.stack([x, y], axis=1), pitch)
    return [_part(surfels, wood * _floor_light(x, y))]


def _floor_light(x: Floats, y: Floats) -> Points:
    """(N, 3) factors: corners, the ball's shadow, and warm sun."""
    reach = x**2 + y**2 + RADIUS**2
    shadow = 1.0 - 0.62 * (RADIUS**2 / reach) ** 1.5 - 0.25 * np.exp(-(x**2 + y**2) / 0.02**2)
    even = _corner(HIGH[0] - x) * _corner(HIGH[1] - y) * shadow
    return 0.92 * even[:, None] + _sunlit(x, y)[:, None] * np.array([0.52, 0.47, 0.36])


def _walls() -> list[Part]:
    out = []
    for wall, (color, corner, along, length, other) in {
        "back": (GREEN, np.array([HIGH[0], LOW[1], 0.0]), np.array([0.0, 1.0, 0.0]), HIGH[1] - LOW[1], None),
        "left": (PLASTER, np.array([LOW[0], HIGH[1], 0.0]), np.array([1.0, 0.0, 0.0]), HIGH[0] - LOW[0], PANE),
    }.items():
        a, z = (part.ravel() for part in np.meshgrid(np.arange(0.015, length, 0.03), np.arange(0.015, WALL, 0.03)))
        if other:
            x = a + LOW[0]
            kept = ~((x > other[0] - 0.06) & (x < other[1] + 0.06) & (z > other[2] - 0.06) & (z < other[3] + 0.06))
            a, z = a[kept], z[kept]
        light = _corner(z) * _corner(length - a) * (0.94 + 0.06 * z / WALL)
        if wall == "back":  # the light of the window on the wall beside it
            light = light + 0.10 * np.exp(-(((length - a - 0.75) / 0.7) ** 2))
        out.append(_part(tiles(corner, along, np.eye(3)[2], np.stack([a, z], axis=1), np.full((len(a), 2), 0.03)),
                         color * light[:, None]))  # fmt: skip
    return out


def _window() -> list[Part]:
    """Panes and their frame, in fine tiles: colours change at straight edges."""
    left, right, low, high = PANE
    x, z = (
        part.ravel()
        for part in np.meshgrid(np.arange(left - 0.08, right + 0.08, 0.012), np.arange(low - 0.08, high + 0.08, 0.012))
    )
    glass = _pane(x, z, 0.004)
    beyond = (x < left - 0.05) | (x > right + 0.05) | (z < low - 0.05) | (z > high + 0.05)
    frame = np.where(beyond[:, None], PLASTER * (_corner(z) * 0.95)[:, None], WHITE)
    # brighter towards the sky, with something green outside
    height = (z - low) / (high - low)
    outside = (
        SKY + 0.12 * height[:, None] - np.array([0.34, 0.18, 0.46]) * (1.0 - _step((height - 0.32) / 0.14))[:, None]
    )
    colors = frame * (1.0 - glass)[:, None] + outside * glass[:, None]
    centres = np.stack([x, z], axis=1)
    corner = np.array([0.0, HIGH[1] - 2e-3, 0.0])
    return [_part(tiles(corner, np.eye(3)[0], np.eye(3)[2], centres, np.full((len(x), 2), 0.012)), colors)]


def _skirting() -> list[Part]:
    out = []
    for corner, along, length in (
        (np.array([HIGH[0] - 0.012, LOW[1], 0.0]), np.eye(3)[1], HIGH[1] - LOW[1]),
        (np.array([LOW[0], HIGH[1] - 0.012, 0.0]), np.eye(3)[0], HIGH[0] - LOW[0]),
    ):
        a, z = (part.ravel() for part in np.meshgrid(np.arange(0.02, length, 0.04), np.arange(0.004, BOARD, 0.008)))
        light = (0.72 + 0.28 * _step((z - 0.012) / 0.012)) * _corner(length - a) * np.where(z > BOARD - 0.01, 1.05, 1.0)
        pitch = np.tile([0.04, 0.008], (len(a), 1))
        out.append(_part(tiles(corner, along, np.eye(3)[2], np.stack([a, z], axis=1), pitch), WHITE * light[:, None]))
    return out


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m odeform.geometry.volleyball", description=__doc__)
    parser.add_argument("--out", required=True, metavar="FILE.spz")
    path = Path(parser.parse_args().out)
    write_aside(path, spz_bytes(FILE.shape(volleyball_in_room()), fraction=14))
    write_aside(region_beside(path), json.dumps(region_to_json(REGION.moved(FILE)), indent=1).encode())
    print(f"{path}: {path.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    sys.exit(main())
