"""The shadow of Gaussian splats, which cast none: that of an invisible hull around them."""

import numpy as np
import trimesh
import viser

from odeform.geometry.shape import without_outliers
from odeform.types import Points
from odeform_viz.rendering.glb import GlbWriter

__all__ = ["cast_shadow"]

MOST = 5000  # points that the hull is made from


def cast_shadow(server: viser.ViserServer, node: str, points: Points) -> None:
    """Add the hull of `points` (N, 3) m at rest; it moves with its parent node, and does not deform."""
    chosen = np.random.default_rng(0).permutation(points)[:MOST]
    hull = trimesh.convex.convex_hull(without_outliers(chosen.astype(float)))
    corners = np.asarray(hull.vertices, dtype=np.float32)
    # transparent glTF writes no depth, so that it hides no splats
    writer = GlbWriter(len(corners), np.asarray(hull.faces), float(np.abs(corners).max()), 0.0, wireframe=False)
    server.scene.add_glb(node, writer.write(corners, np.zeros((len(corners), 3), np.uint8)), receive_shadow=False)
