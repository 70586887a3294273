"""Strain of a surface: how much its triangles are stretched."""

import numpy as np

from odeform.types import Faces, Floats, Mesh, Perpoint, Points

__all__ = ["SurfaceStrain"]


class SurfaceStrain:
    """The largest principal strain of the surface at each vertex, |stretch - 1|, averaged over adjacent triangles."""

    def __init__(self, mesh: Mesh) -> None:
        """`mesh` is at rest. Triangles without area count as unstrained."""
        self._faces, self._count = mesh.faces, len(mesh.points)
        first, second = _edges(np.asarray(mesh.points, dtype=float), mesh.faces)
        length = np.linalg.norm(first, axis=1)
        area = np.linalg.norm(np.cross(first, second), axis=1)
        self._flat = area <= 1e-12 * max(float(area.max()), 1e-300)
        length, height = np.where(self._flat, 1.0, length), np.where(self._flat, 1.0, area)
        # the inverse of the triangle's edges in its own plane: [[length, along], [0, height]]
        along = np.einsum("fi,fi->f", first, second) / length
        height = height / length
        self._inverse = np.stack([1.0 / length, -along / (length * height), 1.0 / height])
        self._weights = np.bincount(mesh.faces.ravel(), np.repeat(area, 3), minlength=self._count)
        self._weights, self._area = np.maximum(self._weights, 1e-300), area

    def __call__(self, points: Points) -> Perpoint:
        """Computes (N,) strain, 1 for 100 %, of the deformed vertices (N, 3) m."""
        first, second = _edges(np.asarray(points, dtype=float), self._faces)
        a, b, c = self._inverse
        u, v = first * a[:, None], first * b[:, None] + second * c[:, None]
        uu, vv, uv = (np.einsum("fi,fi->f", p, q) for p, q in ((u, u), (v, v), (u, v)))
        mean, spread = 0.5 * (uu + vv), np.hypot(0.5 * (uu - vv), uv)
        longest, shortest = np.sqrt(mean + spread), np.sqrt(np.maximum(mean - spread, 0.0))
        strain = np.where(self._flat, 0.0, np.maximum(np.abs(longest - 1.0), np.abs(shortest - 1.0)))
        total = np.bincount(self._faces.ravel(), np.repeat(self._area * strain, 3), minlength=self._count)
        return total / self._weights


def _edges(points: Floats, faces: Faces) -> tuple[Floats, Floats]:
    corners = points[faces]
    return corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
