"""Nodes of a shape in viser's scene: points, Gaussian splats, or a mesh (see `meshes`)."""

from typing import Protocol

import numpy as np
import viser

from odeform.types import Floats, GaussianSplats, Geometry, Mesh, PointCloud, Points
from odeform_viz.colors import Color
from odeform_viz.rendering.look import Colors, Look
from odeform_viz.rendering.meshes import MeshView
from odeform_viz.rendering.shadow import cast_shadow

__all__ = ["ShapeView", "show_shape"]

SUBNORMAL = float(np.finfo(np.float16).smallest_normal)


class ShapeView(Protocol):
    """A shape in the scene."""

    def show(self, points: Points | None, covariances: Floats | None, look: Look) -> None:
        """Show the shape at `points` (N, 3) in m, or at rest (None); what has not changed is not sent.

        `covariances` (N, 3, 3) in m^2 are those of splats; None for those at rest.
        """
        ...


def show_shape(
    server: viser.ViserServer, root: str, geometry: Geometry, color: Color, shadow: bool = False
) -> ShapeView:
    """Add a shape under the scene node `root`; `shadow` gives splats one, which meshes have by themselves."""
    if isinstance(geometry, Mesh):
        return MeshView(server, root, geometry)
    if isinstance(geometry, GaussianSplats):
        if shadow:
            cast_shadow(server, f"{root}/shadow", geometry.points)
        return _SplatView(server, root, geometry)
    return _CloudView(server, root, geometry, color)


class _CloudView:
    def __init__(self, server: viser.ViserServer, root: str, cloud: PointCloud, color: Color) -> None:
        self._rest = np.asarray(cloud.points, dtype=np.float32)
        plain = np.tile(np.array(color, dtype=np.uint8), (len(cloud.points), 1))
        self._default_colors = plain if cloud.colors is None else cloud.colors
        self._cloud = server.scene.add_point_cloud(
            f"{root}/points", self._rest, self._default_colors, point_size=0.003, precision="float32"
        )
        self._at_rest, self._colors = True, self._default_colors

    def show(self, points: Points | None, covariances: Floats | None, look: Look) -> None:
        if points is not None or not self._at_rest:
            self._cloud.points = self._rest if points is None else points
            self._at_rest = points is None
        colors: Colors = self._default_colors if look.colors is None else look.colors
        if colors is not self._colors:
            self._cloud.colors = self._colors = colors


class _SplatView:
    def __init__(self, server: viser.ViserServer, root: str, splats: GaussianSplats) -> None:
        self._unit = _unit(splats)
        self._default_colors, self._opacities = (
            np.round(255.0 * np.clip(part, 0.0, 1.0)).astype(np.uint8)
            for part in (splats.colors, splats.opacities[:, None])
        )
        self._rest, self._covariances = splats.points, _rescaled(splats.covariances, self._unit)
        self._handle = server.scene.add_gaussian_splats(
            f"{root}/splats",
            self._centers(splats.points),
            self._covariances,
            self._default_colors,
            self._opacities,
            scale=self._unit,
        )
        self._at_rest, self._colors = True, self._default_colors

    def _centers(self, points: Floats) -> Points:
        return (points / self._unit).astype(np.float32)

    def show(self, points: Points | None, covariances: Floats | None, look: Look) -> None:
        """Splats keep their own opacities, and have no wireframe."""
        colors = self._default_colors if look.colors is None else look.colors
        if points is None and self._at_rest and colors is self._colors:
            return
        rescaled = self._covariances if covariances is None else _rescaled(covariances, self._unit)
        centers = self._centers(self._rest if points is None else points)
        self._handle.set_gaussians(centers, rescaled, colors, self._opacities)
        self._at_rest, self._colors = points is None, colors


def _rescaled(covariances: Floats, unit: float) -> Floats:
    """Covariances in units of `unit` metres. NumPy rounds float16 subnormals 50 times as slowly, so they become 0."""
    out = np.divide(covariances, unit**2, dtype=np.float32)
    out *= np.abs(out) >= SUBNORMAL
    return out


def _unit(splats: GaussianSplats) -> float:
    """The unit of the node, in metres: a centimetre, or less where the smaller splats need it.

    Covariances are sent as float16, which loses those of splats smaller than a hundredth of the unit.
    """
    sizes = np.sqrt(0.5 * np.trace(splats.covariances, axis1=1, axis2=2))
    return float(np.clip(10.0 * np.quantile(sizes, 0.05), 1e-6, 0.01))
