"""Shapes -> viser handles: a mesh in a pattern or in error colours, points, Gaussian splats."""

from typing import Protocol

import numpy as np
import viser

from odeform.types import Floats, GaussianSplats, Geometry, Mesh, Perpoint, Points
from odeform_viz.rendering.checkerboard import checkerboard_parts
from odeform_viz.rendering.error_colors import BANDS, bands_of, levels_of

__all__ = ["Color", "ShapeView", "show_shape"]

Color = tuple[int, int, int]

SUBNORMAL = float(np.finfo(np.float16).smallest_normal)


class ShapeView(Protocol):
    """A shape in the scene. `move` takes its points (N, 3) and, of splats, covariances (N, 3, 3), None for those at
    rest; `paint` values (N,) on a scale that ends at `top`."""

    def move(self, points: Points, covariances: Floats | None = None) -> None: ...

    def paint(self, points: Points, values: Perpoint, top: float) -> None: ...

    def fade(self, opacity: float | None) -> None: ...


def show_shape(server: viser.ViserServer, root: str, geometry: Geometry, color: Color) -> ShapeView:
    if isinstance(geometry, Mesh):
        return _MeshView(server, root, geometry, color)
    if isinstance(geometry, GaussianSplats):
        return _SplatView(server, root, geometry)
    return _CloudView(server, root, geometry.points, color)


class _MeshView:
    def __init__(self, server: viser.ViserServer, root: str, mesh: Mesh, color: Color) -> None:
        self._server, self._root, self._mesh = server, root, mesh
        points = np.asarray(mesh.points, dtype=np.float32)
        red, green, blue = (round(0.45 * c + 0.55 * 235) for c in color)
        self._parts = []
        shades = (color, (red, green, blue))
        for index, (part, shade) in enumerate(zip(checkerboard_parts(mesh), shades, strict=False)):
            name = f"{root}/part_{index}"
            self._parts.append((server.scene.add_mesh_simple(name, part.of(points), part.faces, color=shade), part))
        self._bands: list[viser.MeshHandle | None] = [None] * len(BANDS)
        self._opacity: float | None = None

    def move(self, points: Points, covariances: Floats | None = None) -> None:
        for handle, part in self._parts:
            handle.vertices = part.of(points)
            handle.visible = True
        for band in self._bands:
            if band is not None:
                band.visible = False

    def paint(self, points: Points, values: Perpoint, top: float) -> None:
        for handle, _ in self._parts:
            handle.visible = False
        for index, part in enumerate(bands_of(values, self._mesh.faces, top)):
            if part is None:
                old = self._bands[index]
                if old is not None:
                    old.visible = False
                continue
            used, faces = part
            # as a new node of the same name: vertices and faces that change apart would not fit for a moment
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
        self._color = np.tile(np.array(color, dtype=np.uint8), (len(points), 1))
        self._cloud = server.scene.add_point_cloud(
            f"{root}/points", points, self._color, point_size=0.003, precision="float32"
        )

    def move(self, points: Points, covariances: Floats | None = None) -> None:
        self._cloud.points = points
        self._cloud.colors = self._color

    def paint(self, points: Points, values: Perpoint, top: float) -> None:
        self._cloud.points = points
        self._cloud.colors = np.array(BANDS, dtype=np.uint8)[levels_of(values, top)]

    def fade(self, opacity: float | None) -> None:
        """Points are seen through anyway."""


class _SplatView:
    def __init__(self, server: viser.ViserServer, root: str, splats: GaussianSplats) -> None:
        self._scale = _unit(splats)
        self._look = [
            np.round(255.0 * np.clip(part, 0.0, 1.0)).astype(np.uint8)
            for part in (splats.colors, splats.opacities[:, None])
        ]
        self._covariances = _shrunk(splats.covariances, self._scale)
        self._handle = server.scene.add_gaussian_splats(
            f"{root}/splats", self._scaled(splats.points), self._covariances, *self._look, scale=self._scale
        )

    def _scaled(self, points: Floats) -> Points:
        return (points / self._scale).astype(np.float32)

    def move(self, points: Points, covariances: Floats | None = None) -> None:
        shown = self._covariances if covariances is None else _shrunk(covariances, self._scale)
        self._handle.set_gaussians(self._scaled(points), shown, *self._look)

    def paint(self, points: Points, values: Perpoint, top: float) -> None:
        self.move(points)

    def fade(self, opacity: float | None) -> None:
        """Splats have opacities of their own."""


def _shrunk(covariances: Floats, unit: float) -> Floats:
    """Covariances in units of their own; what is subnormal as float16 takes NumPy fifty times as long to round."""
    out = np.divide(covariances, unit**2, dtype=np.float32)
    out *= np.abs(out) >= SUBNORMAL
    return out


def _unit(splats: GaussianSplats) -> float:
    """The metres to send splats in, in a node of that scale: centimetres, or less where the smaller splats need it.

    Covariances travel as float16, which loses those of splats under a hundredth of a unit.
    """
    sizes = np.sqrt(0.5 * np.trace(splats.covariances, axis1=1, axis2=2))
    return float(np.clip(10.0 * np.quantile(sizes, 0.05), 1e-6, 0.01))
