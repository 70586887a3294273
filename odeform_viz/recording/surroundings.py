"""Logs what surrounds the columns: the floor, the part of a scene that does not move, and arrows."""

from collections.abc import Sequence

import numpy as np
import rerun as rr

from odeform.loads.arrow import Arrow
from odeform.loads.obstacle import Obstacle
from odeform.types import GaussianSplats, Geometry, Mesh
from odeform_viz.colors import ACTING, BACKGROUND
from odeform_viz.recording.entities import FLOOR, STILL
from odeform_viz.recording.splats import splats_at_rest

__all__ = ["log_arrows", "log_obstacles", "log_surroundings"]

HALF, CELL = 3.0, 0.25  # m; of the floor and its grid
PLANE, LINES = (236, 238, 242), (190, 194, 202)


def log_surroundings(stream: rr.RecordingStream, still: Geometry | None) -> None:
    """Log the part of a scene that does not move, in place of what was there; None for the floor."""
    stream.log(STILL, rr.Clear(recursive=True))
    if still is None:
        _log_floor(stream)
        return
    stream.log(FLOOR, rr.Clear(recursive=True))
    if isinstance(still, Mesh):
        stream.log(f"{STILL}/mesh", rr.Mesh3D(vertex_positions=still.points, triangle_indices=still.faces))
    elif isinstance(still, GaussianSplats):
        stream.log(f"{STILL}/splats", splats_at_rest(still))
    else:
        stream.log(f"{STILL}/points", rr.Points3D(still.points))


def _log_floor(stream: rr.RecordingStream) -> None:
    corners = HALF * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=np.float32)
    up = np.tile(np.array([0, 0, 1], dtype=np.float32), (4, 1))
    plane = rr.Mesh3D(
        vertex_positions=corners - np.array([0, 0, 2e-3], dtype=np.float32),  # below the lines, which would flicker
        triangle_indices=[[0, 1, 2], [0, 2, 3]],
        vertex_normals=up,
        vertex_colors=[PLANE] * 4,
    )
    stream.log(f"{FLOOR}/plane", plane)
    at = np.arange(-HALF, HALF + 0.5 * CELL, CELL)
    lines = [[(x, -HALF, 0.0), (x, HALF, 0.0)] for x in at] + [[(-HALF, y, 0.0), (HALF, y, 0.0)] for y in at]
    stream.log(f"{FLOOR}/lines", rr.LineStrips3D(lines, colors=LINES, radii=rr.Radius.ui_points(0.35)))


def log_arrows(stream: rr.RecordingStream, entity: str, arrows: Sequence[Arrow], size: float) -> None:
    """Log what acts on a body of `size` m, in place of what acted before."""
    if not arrows:
        stream.log(entity, rr.Clear(recursive=False))
        return
    drawn = rr.Arrows3D(
        origins=[arrow.start for arrow in arrows],
        vectors=[arrow.vector for arrow in arrows],
        labels=[arrow.label for arrow in arrows],
        colors=[ACTING] * len(arrows),
        radii=0.02 * size,
    )
    stream.log(entity, drawn)


def log_obstacles(stream: rr.RecordingStream, entity: str, obstacles: Sequence[Obstacle]) -> None:
    """Log what a body meets besides the floor, in place of what was there."""
    stream.log(entity, rr.Clear(recursive=True))
    for index, obstacle in enumerate(obstacles):
        mesh = obstacle.mesh
        points, faces = mesh.points[mesh.faces].reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3)
        colors = [BACKGROUND] * len(points)
        stream.log(
            f"{entity}/{index}", rr.Mesh3D(vertex_positions=points, triangle_indices=faces, vertex_colors=colors)
        )
