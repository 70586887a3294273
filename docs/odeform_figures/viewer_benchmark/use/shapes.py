"""Shapes: meshes, splats and broken files."""

import numpy as np
import trimesh

from odeform_figures.viewer_benchmark.visitors import Visitors
from odeform_viz.user_bodies import takes_user_bodies

__all__ = ["load_shapes"]

UPLOAD, CANCEL = "Load a shape...", "Cancel"
BACK = {False: "Back to the trained body", True: "Back to the trained bodies"}


def load_shapes(visitors: Visitors) -> None:
    """Upload a broken file, a mesh and splats, move each, and go back to the trained body."""
    app, client = visitors.app, visitors.first
    predictor = app.columns.all[0].predictor
    own = predictor is not None and takes_user_bodies(predictor)
    client.upload(UPLOAD, "broken.ply", b"ply\nformat ascii 1.0\nelement vertex 9\n")
    visitors.expect_refusal("broken.ply")
    contents = {"ball.obj": _ball()} if own else {"ball.obj": _ball(), "ball.splat": _splats()}
    for name, content in contents.items():
        before = app.columns.all[0].geometry
        client.upload(UPLOAD, name, content)
        visitors.expect(f"the shape {name}", lambda before=before: app.columns.all[0].geometry is not before)
        visitors.expect_control(BACK[own])
        visitors.drag(visitors.second, 10)
    visitors.second.click(BACK[own])
    visitors.expect("the trained body", lambda: not app.columns.all[0].loaded)


def _ball() -> bytes:
    return str(trimesh.creation.icosphere(subdivisions=3, radius=0.05).export(file_type="obj")).encode()


def _splats(count: int = 500) -> bytes:
    """Gaussian splats on a sphere: for each a position, a scale, a colour and a rotation in 32 bytes."""
    normals = np.random.default_rng(0).normal(size=(count, 3))
    positions = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype("<f4")
    scales, rest = (
        np.full((count, 3), 0.05, "<f4"),
        np.tile(np.array([200, 90, 40, 255, 255, 128, 128, 128], "u1"), (count, 1)),
    )
    return b"".join(p.tobytes() + s.tobytes() + r.tobytes() for p, s, r in zip(positions, scales, rest, strict=True))
