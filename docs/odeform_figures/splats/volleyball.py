"""A volleyball in a small room, as Gaussian splats: `python -m odeform_figures.splats.volleyball --out volleyball.spz`.

The ball has the size of the bundled models' body. With `--gloss` it has a highlight that moves with the view, by
harmonics of degree 3, as a `.ply`.
"""

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from odeform.formats.bundled import region_beside
from odeform.formats.splat_spz import spz_bytes
from odeform.formats.writing import write_shape
from odeform.geometry.parts import concatenated, subset
from odeform.geometry.region import Sphere, region_to_json
from odeform.geometry.rigid import rotation_from_vector
from odeform.geometry.similarity import UPRIGHT, Similarity
from odeform.io import atomic_write
from odeform.types import Floats, GaussianSplats, Harmonics, Ints, Perpoint, Points, Vectors
from odeform_figures.splats.gloss import glossy
from odeform_figures.splats.room import SUN, room
from odeform_figures.splats.surfels import COVER, Surfels, grid, joined_surfels, splats_of

__all__ = ["BALL", "REGION", "main", "polished", "volleyball_in_room"]

RADIUS = 0.1  # m
BESIDE = (0.65e-3, 0.65e-3, 0.65e-3, 1.2e-3)  # m: rows from a seam on, the first two in its groove
WIDE, LONG = 14, 49  # further rows across a panel, and along it
BALL = 18 * (WIDE + 2 * len(BESIDE)) * (LONG + 2 * len(BESIDE))  # splats
PANELS = np.array([[0.96, 0.76, 0.10], [0.93, 0.92, 0.88], [0.11, 0.27, 0.60]])  # yellow, white, blue
SEAM = 1.3e-3  # m, half the width of a groove

REGION = Sphere(np.array([0.0, 0.0, 0.105]), 0.1052)
"""The ball, in metres with z up. It touches the floor from above and contains none of it."""
FILE = Similarity(rotation=UPRIGHT["-y"].T)
"""Turns z up into the axes of captures: y down, z forward."""


def volleyball_in_room() -> GaussianSplats:
    """Makes the scene in metres, z up, with the ball on the floor at the origin and its splats first.
    Deterministic."""
    return splats_of(joined_surfels([_ball(), room(RADIUS, np.random.default_rng(7))]))


def polished(splats: GaussianSplats) -> GaussianSplats:
    """Gives the ball of `volleyball_in_room` a highlight of the sun and one of the sky."""
    ball, around = subset(splats, slice(0, BALL)), subset(splats, slice(BALL, None))
    normals = (ball.points - np.array([0.0, 0.0, RADIUS])) / RADIUS
    lit = ball
    for toward, strength in ((-SUN / np.linalg.norm(SUN), 0.55), (np.array([0.0, 0.0, 1.0]), 0.2)):
        shone = glossy(replace(ball, harmonics=np.zeros_like(ball.harmonics)), normals, toward, strength)
        lit = replace(lit, harmonics=shone.harmonics + _padded(lit.harmonics, shone.harmonics.shape[1]))
    still = replace(around, harmonics=_padded(around.harmonics, lit.harmonics.shape[1]))
    out = concatenated(lit, still)
    assert isinstance(out, GaussianSplats)
    return out


def _padded(harmonics: Harmonics, count: int) -> Harmonics:
    return np.pad(harmonics, ((0, 0), (0, count - harmonics.shape[1]), (0, 0)))


def _ball() -> Surfels:
    """Splats in rows along the seams, narrow beside them: colours change where rows do, so that edges are sharp."""
    centre, radius = np.array([0.0, 0.0, RADIUS]), RADIUS - 5e-4
    points, along, across, sizes = (np.concatenate(part) for part in zip(*map(_face, range(6)), strict=True))
    panel, away = _panels(points)
    turn = rotation_from_vector(np.array([0.33, -0.09, 0.49]))
    normals = points @ turn
    puffed = 1.0 - 0.10 * np.exp(-((away / 6e-3) ** 2))  # panels curve down towards their seams
    groove = np.where(away < SEAM, 0.0, 1.0)
    light = 0.86 + 0.14 * normals @ np.array([0.05, 0.45, 0.89])
    colors = PANELS[panel] * (puffed * (0.34 + 0.66 * groove) * light)[:, None]
    return Surfels(centre + radius * normals, along @ turn, across @ turn, radius * sizes, colors)


def _rows(count: int, length: float) -> tuple[Floats, Floats]:
    """Middles and lengths (N,) of `count` rows over `length` m, and of narrow ones beside the seams at both ends."""
    narrow = np.array(BESIDE)
    wide = np.full(count, (length - 2.0 * narrow.sum()) / count)
    lengths = np.concatenate([narrow, wide, narrow[::-1]])
    return np.cumsum(lengths) - 0.5 * lengths, lengths


def _face(face: int) -> tuple[Points, Vectors, Vectors, Floats]:
    """A sixth of a sphere of radius 1: points, two tangents and standard deviations along them, of a cube's face.

    Rows are even in the two angles from the middle of the face.
    """
    side = 0.5 * np.pi * RADIUS
    (third, thirds), (whole, wholes) = _rows(WIDE, side / 3.0), _rows(LONG, side)
    across = np.concatenate([third + k * side / 3.0 for k in range(3)])
    (x, y), (wide, long) = grid(across, whole), grid(np.tile(thirds, 3), wholes)
    tangents = np.tan(np.stack([x, y], axis=1) / RADIUS - 0.25 * np.pi)
    corner = np.roll(np.column_stack([np.full(len(x), 1.0 if face < 3 else -1.0), tangents]), face % 3, axis=1)
    length = np.linalg.norm(corner, axis=1)
    axes, sizes = [], []
    for k, pitch in ((1, wide), (2, long)):
        slope = np.roll(np.eye(3)[k], face % 3) * (1.0 + tangents[:, k - 1 : k] ** 2) / length[:, None]
        slope -= corner * ((slope * corner).sum(axis=1) / length**2)[:, None]
        stretch = np.linalg.norm(slope, axis=1)
        axes.append(slope / stretch[:, None])
        sizes.append(COVER * stretch * pitch / RADIUS)
    return corner / length[:, None], axes[0], axes[1], np.stack(sizes, axis=1)


def _panels(directions: Points) -> tuple[Ints, Perpoint]:
    """The panel (0 to 2) of each direction (N, 3), and its distance to the nearest seam in m.

    Six groups of three panels lie on the faces of a cube, each perpendicular to its neighbours.
    """
    axis, rows = np.abs(directions).argmax(axis=1), np.arange(len(directions))
    depth = np.abs(directions[rows, axis])
    # angles from the middle of the group, scaled to [-1, 1]
    across, along = (np.arctan2(directions[rows, (axis + k) % 3], depth) * 4.0 / np.pi for k in (1, 2))
    panel = np.clip((1.5 * (across + 1.0)).astype(int), 0, 2)
    away = np.minimum(np.abs(np.abs(across) - 1.0 / 3.0), 1.0 - np.maximum(np.abs(across), np.abs(along)))
    return panel, away * 0.25 * np.pi * RADIUS


def main() -> None:
    """Write the splats and their region from the command line."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.splats.volleyball", description=__doc__)
    parser.add_argument("--out", required=True, metavar="FILE.spz")
    parser.add_argument("--gloss", action="store_true", help="with a highlight that moves with the view, as FILE.ply")
    args = parser.parse_args()
    path = Path(args.out)
    if args.gloss:
        write_shape(FILE.shape(polished(volleyball_in_room())), path)
    else:
        atomic_write(path, spz_bytes(FILE.shape(volleyball_in_room()), fraction=14))
    atomic_write(region_beside(path), json.dumps(region_to_json(REGION.transformed(FILE)), indent=1).encode())
    print(f"{path}: {path.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    sys.exit(main())
