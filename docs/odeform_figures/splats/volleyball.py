"""A volleyball in a small room, as Gaussian splats: `python -m odeform_figures.splats.volleyball --out volleyball.spz`.

The ball has the size of the bundled models' body.
"""

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from odeform.formats.bundled import region_beside
from odeform.formats.splat_spz import spz_bytes
from odeform.geometry.region import Sphere, region_to_json
from odeform.geometry.rigid import rotation_from_vector
from odeform.geometry.similarity import UPRIGHT, Similarity
from odeform.io import atomic_write
from odeform.types import GaussianSplats, Ints, Perpoint, Points
from odeform_figures.splats.room import room
from odeform_figures.splats.surfels import Surfels, joined_surfels, sphere_surfels, splats_of

__all__ = ["BALL", "REGION", "main", "volleyball_in_room"]

RADIUS = 0.1  # m
BALL = 24_000  # splats
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


def _ball() -> Surfels:
    centre, radius = np.array([0.0, 0.0, RADIUS]), RADIUS - 5e-4
    ball = sphere_surfels(centre, radius, BALL)
    normals = (ball.points - centre) / radius
    panel, away = _panels(normals @ rotation_from_vector(np.array([0.33, -0.09, 0.49])).T)
    puffed = 1.0 - 0.10 * np.exp(-((away / 6e-3) ** 2))  # panels curve down towards their seams
    groove = np.clip((away - SEAM) / 8e-4 + 0.5, 0.0, 1.0)
    light = 0.88 + 0.12 * normals @ np.array([0.05, 0.45, 0.89])
    return replace(ball, colors=PANELS[panel] * (puffed * (0.42 + 0.58 * groove) * light)[:, None])


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
    path = Path(parser.parse_args().out)
    atomic_write(path, spz_bytes(FILE.shape(volleyball_in_room()), fraction=14))
    atomic_write(region_beside(path), json.dumps(region_to_json(REGION.transformed(FILE)), indent=1).encode())
    print(f"{path}: {path.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    sys.exit(main())
