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
"""Standard deviations, in radii of the body, and strengths of the parts of a shadow: that of an even sky."""
WIDEST, PITCH = 2.4, 0.14  # radii: of the shadow, and from one splat to the next, which is their standard deviation too
LAYERS = 1.5  # splats that lie over a place of the floor: half of those that overlap there
FLAT, RAISED = 1e-3, 4e-3  # m: how thick the shadow is, and how far above the floor


def cast_shadow(server: viser.ViserServer, node: str, points: Points) -> None:
    """Add the hull of `points` (N, 3) m at rest; it moves with its parent node, and does not deform."""
    chosen = np.random.default_rng(0).permutation(points)[:MOST]
    hull = trimesh.convex.convex_hull(without_outliers(chosen.astype(float)))
    corners = np.asarray(hull.vertices, dtype=np.float32)
    # transparent glTF writes no depth, so that it hides no splats
    writer = GlbWriter(len(corners), np.asarray(hull.faces), float(np.abs(corners).max()), 0.0, wireframe=False)
    server.scene.add_glb(node, writer.write(corners, np.zeros((len(corners), 3), np.uint8)), receive_shadow=False)


class FloorShadow:
    """Dark splats on the floor below a body, wider and fainter the higher it is.

    Many small ones: browsers draw splats in the order of their centres, so that the floor would cover a large one.
    """

    def __init__(self, server: viser.ViserServer, node: str, points: Points) -> None:
        """`points` (N, 3) m of the body at rest on the floor."""
        low, high = np.quantile(points, 0.02, axis=0), np.quantile(points, 0.98, axis=0)
        self._radius = 0.5 * float((high - low)[:2].max())
        self._rest = float(0.5 * (low + high)[2])
        line = np.arange(-WIDEST, WIDEST + 0.5 * PITCH, PITCH)
        places = np.stack([part.ravel() for part in np.meshgrid(line, line, [0.0])], axis=1)
        away = np.linalg.norm(places, axis=1)
        self._away, places = away[away <= WIDEST], places[away <= WIDEST]
        flat = np.diag([(PITCH * self._radius) ** 2, (PITCH * self._radius) ** 2, FLAT**2]).astype(np.float32)
        self._height = 0.0
        self._splats = server.scene.add_gaussian_splats(
            node,
            centers=(self._radius * places).astype(np.float32),
            covariances=np.tile(flat, (len(places), 1, 1)),
            rgbs=np.zeros((len(places), 3), np.float32),
            opacities=self._opacities(),
        )

    def _opacities(self) -> Floats:
        """(N, 1) of the splats, under a body that is `_height` radii above where it rests."""
        spread = 1.0 + 0.5 * self._height
        light = np.ones_like(self._away)
        for size, strength in SOFT:
            light *= 1.0 - strength / spread**2 * np.exp(-0.5 * (self._away / size / spread) ** 2)
        return (1.0 - light[:, None] ** (1.0 / LAYERS)).astype(np.float32)

    def show(self, centre: Floats) -> None:
        """Put it below a body whose centre is at (3,) m."""
        self._splats.position = (float(centre[0]), float(centre[1]), RAISED)
        height = round(max(float(centre[2]) - self._rest, 0.0) / self._radius, 2)
        if height != self._height:  # a body that rolls sends a position only
            self._height = height
            self._splats.opacities = self._opacities()
