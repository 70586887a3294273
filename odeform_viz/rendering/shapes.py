"""Nodes of a shape in viser's scene: a mesh as a checkerboard or in error colors, points, Gaussian splats."""

from typing import Protocol

import numpy as np
import viser

from odeform.types import Floats, GaussianSplats, Geometry, Mesh, Perpoint, Points
from odeform_viz.colors import Color, paler
from odeform_viz.rendering.checkerboard import checkerboard_parts
from odeform_viz.rendering.error_colors import BANDS, band_indices, split_into_bands

__all__ = ["ShapeView", "show_shape"]

SUBNORMAL = float(np.finfo(np.float16).smallest_normal)


class ShapeView(Protocol):
    """A shape in the scene."""

    def move(self, points: Points, covariances: Floats | None = None) -> None:
        """Show the shape at `points` (N, 3) in m, in its own colors.

        `covariances` (N, 3, 3) in m^2 are those of splats; None for those at rest.
        """
        ...

    def paint(self, points: Points, values: Perpoint, top: float) -> None:
        """Show the shape at `points` (N, 3) in m, colored by `values` (N,) on a scale from 0 to `top`."""
        ...

    def fade(self, opacity: float | None) -> None:
        """Set the opacity, 0 to 1; None for opaque."""
        ...


def show_shape(server: viser.ViserServer, root: str, geometry: Geometry, color: Color) -> ShapeView:
    """Add a shape under the scene node `root`."""
    if isinstance(geometry, Mesh):
        return _MeshView(server, root, geometry, color)
    if isinstance(geometry, GaussianSplats):
        return _SplatView(server, root, geometry)
    return _CloudView(server, root, geometry.points, color)


class _MeshView:
    def __init__(self, server: viser.ViserServer, root: str, mesh: Mesh, color: Color) -> None:
        self._server, self._root, self._mesh = server, root, mesh
        points = np.asarray(mesh.points, dtype=np.float32)
        self._parts = []
        for index, (part, shade) in enumerate(zip(checkerboard_parts(mesh), (color, paler(color)), strict=False)):
            name, vertices = f"{root}/part_{index}", part.vertices(points)
            self._parts.append((server.scene.add_mesh_simple(name, vertices, part.faces, color=shade), part))
        self._bands: list[viser.MeshHandle | None] = [None] * len(BANDS)
        self._opacity: float | None = None

    def move(self, points: Points, covariances: Floats | None = None) -> None:
        for handle, part in self._parts:
            handle.vertices = part.vertices(points)
            handle.visible = True
        for band in self._bands:
            if band is not None:
                band.visible = False

    def paint(self, points: Points, values: Perpoint, top: float) -> None:
        for handle, _ in self._parts:
            handle.visible = False
        for index, part in enumerate(split_into_bands(values, self._mesh.faces, top)):
            if part is None:
                previous = self._bands[index]
                if previous is not None:
                    previous.visible = False
                continue
            used, faces = part
            # a new node of the same name: updating vertices and faces separately would mismatch for a moment
            self._bands[index] = self._server.scene.add_mesh_simple(
                f"{self._root}/band_{index}", points[used], faces, color=BANDS[index], opacity=self._opacity
            )

    def fade(self, opacity: float | None) -> None:
        self._opacity = opacity
        for handle, _ in self._parts:
            handle.opacity = opacity


class _CloudView:
    def __init__(self, server: viser.ViserServer, root: str, points: Points, color: Color) -> None:
        points = np.asarray(points, dtype=np.float32)
        self._colors = np.tile(np.array(color, dtype=np.uint8), (len(points), 1))
        self._cloud = server.scene.add_point_cloud(
            f"{root}/points", points, self._colors, point_size=0.003, precision="float32"
        )

    def move(self, points: Points, covariances: Floats | None = None) -> None:
        self._cloud.points = points
        self._cloud.colors = self._colors

    def paint(self, points: Points, values: Perpoint, top: float) -> None:
        self._cloud.points = points
        self._cloud.colors = np.array(BANDS, dtype=np.uint8)[band_indices(values, top)]

    def fade(self, opacity: float | None) -> None:
        """Nothing to do: one sees through points anyway."""


class _SplatView:
    def __init__(self, server: viser.ViserServer, root: str, splats: GaussianSplats) -> None:
        self._unit = _unit(splats)
        self._colors, self._opacities = (
            np.round(255.0 * np.clip(part, 0.0, 1.0)).astype(np.uint8)
            for part in (splats.colors, splats.opacities[:, None])
        )
        self._covariances = _rescaled(splats.covariances, self._unit)
        self._handle = server.scene.add_gaussian_splats(
            f"{root}/splats",
            self._centers(splats.points),
            self._covariances,
            self._colors,
            self._opacities,
            scale=self._unit,
        )

    def _centers(self, points: Floats) -> Points:
        return (points / self._unit).astype(np.float32)

    def move(self, points: Points, covariances: Floats | None = None) -> None:
        rescaled = self._covariances if covariances is None else _rescaled(covariances, self._unit)
        self._handle.set_gaussians(self._centers(points), rescaled, self._colors, self._opacities)

    def paint(self, points: Points, values: Perpoint, top: float) -> None:
        """Splats keep their own colors."""
        self.move(points)

    def fade(self, opacity: float | None) -> None:
        """Splats keep their own opacities."""


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
