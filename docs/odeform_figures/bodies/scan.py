"""A scanned shoe, made by code: `python -m odeform_figures.bodies.scan shoe.ply`.

It is as scans are: open where the sole stood on the table, noisy, coloured at its vertices, and thin-walled.
"""

import argparse
from pathlib import Path

import numpy as np
import trimesh
from scipy.interpolate import PchipInterpolator

from odeform.types import Mesh, Perpoint, Points
from odeform_figures.bodies.level_set import surface_of
from odeform_figures.bodies.signed_distance import capsule, smooth_intersection, smooth_union

__all__ = ["scanned_shoe", "write_shoe"]

LENGTH, EDGE, NOISE = 0.26, 0.004, 2e-4  # m: of the shoe, of a triangle, and of the scanner
WALL = 0.010  # m
SOLE, UPPER = (237, 230, 214), (41, 84, 140)  # RGB


def scanned_shoe(seed: int = 0) -> Mesh:
    """The surface of a shoe in metres, without what the scanner did not see below it."""
    whole = surface_of(_distance, EDGE)
    rng = np.random.default_rng(seed)
    points = whole.points + NOISE * rng.standard_normal(whole.points.shape)
    seen = (points[whole.faces][..., 2] > 0.0015).any(axis=1)
    used, faces = np.unique(whole.faces[seen], return_inverse=True)
    points = points[used]
    faces = faces.reshape(-1, 3).astype(np.int32)
    colors = np.where(points[faces][..., 2:] < 0.022, SOLE, UPPER).astype(np.uint8)
    return Mesh(points.astype(np.float32), faces, colors)


def _distance(points: Points) -> Perpoint:
    """(N,) signed distance in metres: a sole, and an upper that is hollow and open at the heel."""
    x, y, z = points.T
    half = 0.5 * LENGTH
    along = np.clip((x + half) / LENGTH, 0.0, 1.0)
    breadth = PchipInterpolator([0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0], [0.022, 0.034, 0.036, 0.036, 0.046, 0.040, 0.020])(
        along
    )
    height = PchipInterpolator([0.0, 0.2, 0.45, 0.7, 1.0], [0.085, 0.080, 0.072, 0.050, 0.030])(along)
    outline = smooth_intersection(np.abs(y) - breadth, np.abs(x) - half, 0.03)
    body = smooth_intersection(outline, np.abs(z - 0.5 * height) - 0.5 * height, 0.02)
    inside = np.maximum(outline + WALL, np.maximum(0.024 - z, z - (height - 0.8 * WALL)))
    opening = capsule(points, (-0.075, 0.0, 0.06), (-0.075, 0.0, 0.14), 0.024)
    cavity = smooth_union(inside, opening, 0.01)
    return smooth_intersection(body, -cavity, 0.004)


def write_shoe(path: str | Path) -> None:
    """Write the shoe as a `.ply` with its colours, which our own writer of shapes has not."""
    shoe = scanned_shoe()
    corner = np.zeros(len(shoe.points), dtype=int)
    corner[shoe.faces.ravel()] = np.arange(shoe.faces.size)
    assert shoe.colors is not None
    colors = shoe.colors.reshape(-1, 3)[corner]
    trimesh.Trimesh(shoe.points, shoe.faces, vertex_colors=colors, process=False).export(path)


def main() -> None:
    """Write the file of the command line."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.bodies.scan", description=__doc__)
    parser.add_argument("out", type=Path, metavar="FILE", help="the file to write, .ply")
    write_shoe(parser.parse_args().out)


if __name__ == "__main__":
    main()
