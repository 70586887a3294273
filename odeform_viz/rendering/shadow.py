"""The shadow of Gaussian splats, which cast none.

On a floor that is lit it is that of an invisible hull; on the floor of a captured scene, dark splats.
"""

import numpy as np
import trimesh
import viser

from odeform.geometry.shape import without_outliers
from odeform.types import Floats, Points
from odeform_viz.rendering.glb import GlbWriter

__all__ = ["FloorShadow", "cast_shadow"]

MOST = 5000  # points that the hull is made from
SOFT = ((0.35, 0.62), (0.75, 0.34), (1.3, 0.16))
"""Standard deviation, in radii of the body, and opacity of each splat of a shadow: that of an even sky."""
FLAT, RAISED = 1e-3, 2e-3  # m: how thick the shadow is, and how far above the floor


def cast_shadow(server: viser.ViserServer, node: str, points: Points) -> None:
    """Add the hull of `points` (N, 3) m at rest; it moves with its parent node, and does not deform."""
    chosen = np.random.default_rng(0).permutation(points)[:MOST]
    hull = trimesh.convex.convex_hull(without_outliers(chosen.astype(float)))
    corners = np.asarray(hull.vertices, dtype=np.float32)
    # transparent glTF writes no depth, so that it hides no splats
    writer = GlbWriter(len(corners), np.asarray(hull.faces), float(np.abs(corners).max()), 0.0, wireframe=False)
    server.scene.add_glb(node, writer.write(corners, np.zeros((len(corners), 3), np.uint8)), receive_shadow=False)


class FloorShadow:
    """Dark splats on the floor below a body, wider and fainter the higher it is."""

    def __init__(self, server: viser.ViserServer, node: str, points: Points) -> None:
        """`points` (N, 3) m of the body at rest on the floor."""
        low, high = np.quantile(points, 0.02, axis=0), np.quantile(points, 0.98, axis=0)
        self._radius = 0.5 * float((high - low)[:2].max())
        self._rest = float(0.5 * (low + high)[2])
        sizes = np.array([size for size, _ in SOFT]) * self._radius
        self._covariances = np.zeros((len(SOFT), 3, 3), np.float32)
        self._covariances[:, 0, 0] = self._covariances[:, 1, 1] = sizes**2
        self._covariances[:, 2, 2] = FLAT**2
        self._height = 0.0
        self._splats = server.scene.add_gaussian_splats(
            node,
            centers=np.zeros((len(SOFT), 3), np.float32),
            covariances=self._covariances,
            rgbs=np.zeros((len(SOFT), 3), np.float32),
            opacities=np.array([[opacity] for _, opacity in SOFT], np.float32),
        )

    def show(self, centre: Floats) -> None:
        """Put it below a body whose centre is at (3,) m."""
        self._splats.position = (float(centre[0]), float(centre[1]), RAISED)
        height = round(max(float(centre[2]) - self._rest, 0.0) / self._radius, 2)
        if height != self._height:  # a body that rolls sends a position only
            self._height, spread = height, 1.0 + 0.5 * height
            wider = np.array([spread**2, spread**2, 1.0], np.float32)
            self._splats.covariances = self._covariances * wider[:, None]
            self._splats.opacities = np.array([[opacity / spread**2] for _, opacity in SOFT], np.float32)
