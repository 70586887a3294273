"""Shapes -> viser handles: a mesh in a pattern or in error colours, points, Gaussian splats."""

from typing import Protocol

import numpy as np
import viser

from odeform.types import Floats, GaussianSplats, Geometry, Ints, Mesh, Perpoint, Points
from odeform_viz.heat import BANDS, bands_of

__all__ = ["Color", "ShapeView", "checker_parts", "show_shape"]

Color = tuple[int, int, int]


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


def checker_parts(mesh: Mesh) -> list[tuple[Ints, Ints]]:
    """A mesh in two parts, octants about its centre in turn: for each the vertices (M,) it uses and its faces (F, 3).

    A body of one colour hides how it turns.
    """
    points = np.asarray(mesh.points, dtype=float)
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    odd = np.prod(points[mesh.faces].mean(axis=1) - centre, axis=1) > 0.0
    parts = []
    for faces in (mesh.faces[odd], mesh.faces[~odd]):
        used, local = np.unique(faces, return_inverse=True)
        parts.append((used, local.reshape(-1, 3)))
    return [part for part in parts if len(part[0])]


class _MeshView:
    def __init__(self, server: viser.ViserServer, root: str, mesh: Mesh, color: Color) -> None:
        self._server, self._root, self._mesh = server, root, mesh
        points = np.asarray(mesh.points, dtype=np.float32)
        red, green, blue = (round(0.45 * c + 0.55 * 235) for c in color)
        self._parts = []
        for index, ((used, faces), shade) in enumerate(
            zip(checker_parts(mesh), (color, (red, green, blue)), strict=False)
        ):
            handle = server.scene.add_mesh_simple(f"{root}/part_{index}", points[used], faces, color=shade)
            self._parts.append((handle, used))
        self._bands: list[viser.MeshHandle | None] = [None] * len(BANDS)

    def move(self, points: Points, covariances: Floats | None = None) -> None:
        for handle, used in self._parts:
            handle.vertices = points[used]
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
                f"{self._root}/band_{index}", points[used], faces, color=BANDS[index]
            )

    def fade(self, opacity: float | None) -> None:
        for handle, _ in self._parts:
            handle.opacity = opacity


class _CloudView:
    def __init__(self, server: viser.ViserServer, root: str, points: Points, color: Color) -> None:
        points = np.asarray(points, dtype=np.float32)
        self._cloud = server.scene.add_point_cloud(
            f"{root}/points", points, color, point_size=0.003, precision="float32"
        )

    def move(self, points: Points, covariances: Floats | None = None) -> None:
        self._cloud.points = points

    def paint(self, points: Points, values: Perpoint, top: float) -> None:
        self.move(points)

    def fade(self, opacity: float | None) -> None:
        """Points are seen through anyway."""


class _SplatView:
    def __init__(self, server: viser.ViserServer, root: str, splats: GaussianSplats) -> None:
        self._scale = _unit(splats)
        self._look = (splats.colors.astype(np.float32), splats.opacities[:, None].astype(np.float32))
        self._covariances = (splats.covariances / self._scale**2).astype(np.float32)
        self._handle = server.scene.add_gaussian_splats(
            f"{root}/splats", self._scaled(splats.points), self._covariances, *self._look, scale=self._scale
        )

    def _scaled(self, points: Floats) -> Points:
        return (points / self._scale).astype(np.float32)

    def move(self, points: Points, covariances: Floats | None = None) -> None:
        shown = self._covariances if covariances is None else covariances / np.float32(self._scale**2)
        self._handle.set_gaussians(self._scaled(points), shown, *self._look)

    def paint(self, points: Points, values: Perpoint, top: float) -> None:
        self.move(points)

    def fade(self, opacity: float | None) -> None:
        """Splats have opacities of their own."""


def _unit(splats: GaussianSplats) -> float:
    """The metres to send splats in, in a node of that scale: centimetres, or less where the smaller splats need it.

    Covariances travel as float16, which loses those of splats under a hundredth of a unit.
    """
    sizes = np.sqrt(0.5 * np.trace(splats.covariances, axis1=1, axis2=2))
    return float(np.clip(10.0 * np.quantile(sizes, 0.05), 1e-6, 0.01))
