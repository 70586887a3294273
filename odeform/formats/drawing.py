"""Pictures of shapes on a floor, by software: orthographic, with a depth buffer, soft edges and a shadow from above."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from odeform.formats.picture_files import Picture
from odeform.geometry.normals import vertex_normals
from odeform.types import Floats, GaussianSplats, Geometry, Mesh

__all__ = ["GREY", "View", "draw"]

SAMPLES = 2  # of a pixel along each axis
AZIMUTH, ELEVATION = np.radians(-38.0), np.radians(26.0)  # of the eye
LIGHT = np.array([-0.35, 0.55, 0.75])  # in the picture's axes: right, up, towards the eye
PAPER, TILE, SHADOW = 250.0, 241.0, 0.86
GREY = (150, 164, 186)  # of what has no colour of its own
FRAGMENTS = 1 << 20  # samples of triangles that are worked on at once


Ints = Int[np.ndarray, " samples"]


@dataclass(frozen=True, eq=False)
class View:
    """Says what a picture shows: `height` metres around `target` (3,) m, in `size` (width, height) pixels.

    `tile` is the side of the floor's squares at z = 0 in m; 0 for a plain floor.
    """

    target: Floats
    height: float
    size: tuple[int, int]
    tile: float = 0.0

    @property
    def axes(self) -> Floats:
        """(3, 3): right, up and towards the eye."""
        a, e = AZIMUTH, ELEVATION
        return np.array(
            [
                [-np.sin(a), np.cos(a), 0.0],
                [-np.cos(a) * np.sin(e), -np.sin(a) * np.sin(e), np.cos(e)],
                [np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)],
            ]
        )

    def project(self, points: Floats) -> Floats:
        """Projects points (N, 3) m: their column and row among the samples, and their nearness to the eye in m."""
        width, height = np.array(self.size) * SAMPLES
        seen = (points - self.target) @ self.axes.T
        scale = height / self.height
        return np.column_stack([0.5 * width + scale * seen[:, 0], 0.5 * height - scale * seen[:, 1], seen[:, 2]])

    def floor(self) -> Floats:
        """Computes (H, W, 3) samples of the floor alone."""
        width, height = np.array(self.size) * SAMPLES
        image = np.full((height, width, 3), PAPER)
        if not self.tile:
            return image
        metres = self.height / height
        right = (np.arange(width) + 0.5 - 0.5 * width) * metres
        up = (0.5 * height - np.arange(height) - 0.5) * metres
        # along the line of sight to where z is 0
        on_plane = self.target + right[None, :, None] * self.axes[0] + up[:, None, None] * self.axes[1]
        away = -on_plane[..., 2:] / self.axes[2, 2]
        places = np.floor((on_plane + away * self.axes[2])[..., :2] / self.tile).astype(int)
        image[places.sum(axis=2) % 2 == 1] = TILE
        return image


def draw(geometry: Geometry, view: View, color: tuple[int, int, int] = GREY) -> Picture:
    """A picture of a shape in metres, above a floor at z = 0; `color` is red, green and blue, 0 to 255, where the shape
    has no colours. Splats are drawn as opaque discs of their colours."""
    image = view.floor()
    points = np.asarray(geometry.points, dtype=float)
    # the shadow is that of a lamp above
    shadow = view.project(points * [1.0, 1.0, 0.0])
    _put(image, _samples(geometry, shadow, view, None))
    _put(image, _samples(geometry, view.project(points), view, _colors(geometry, view, color)))
    width, height = view.size
    return image.reshape(height, SAMPLES, width, SAMPLES, 3).mean(axis=(1, 3)).astype(np.uint8)


@dataclass(frozen=True, eq=False)
class _Samples:
    """Samples (M,) of the image, their nearness to the eye, and their colours (M, 3); None for shadow."""

    places: Ints
    depth: Floats
    colors: Floats | None


def _put(image: Floats, samples: Iterator[_Samples]) -> None:
    """Draw the nearest of the samples at each place."""
    flat, buffer = image.reshape(-1, 3), np.full(image.shape[0] * image.shape[1], -np.inf)
    for part in samples:
        order = np.argsort(part.depth)  # the last of several values is the one that stays
        places, depth = part.places[order], part.depth[order]
        nearer = depth > buffer[places]
        places = places[nearer]
        buffer[places] = depth[nearer]
        flat[places] = SHADOW * PAPER if part.colors is None else part.colors[order][nearer]


def _samples(geometry: Geometry, seen: Floats, view: View, colors: Floats | None) -> Iterator[_Samples]:
    width, height = view.size[0] * SAMPLES, view.size[1] * SAMPLES
    if isinstance(geometry, Mesh):
        found = _of_triangles(seen[geometry.faces], colors)
    else:
        found = _of_discs(seen, _radius(geometry, view), colors)
    for columns, rows, depth, tint in found:
        inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
        places = (rows * width + columns)[inside]
        yield _Samples(places, depth[inside], None if tint is None else tint[inside])


def _of_triangles(corners: Floats, colors: Floats | None) -> Iterator[tuple[Ints, Ints, Floats, Floats | None]]:
    """Columns, rows, nearness and colours of the samples in triangles (F, 3, 3), of similar size at a time."""
    low = np.floor(corners[..., :2].min(axis=1)).astype(int)
    sides = np.ceil(corners[..., :2].max(axis=1)).astype(int) - low
    first, second = corners[:, 1, :2] - corners[:, 0, :2], corners[:, 2, :2] - corners[:, 0, :2]
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    scales = np.ceil(np.log2(np.maximum(sides.max(axis=1), 1))).astype(int)
    scales[np.abs(area) < 1e-9] = -1  # seen from the side
    for scale in range(scales.max(initial=-1) + 1):
        side = 2**scale
        grid = np.stack(np.meshgrid(np.arange(side), np.arange(side)), axis=-1).reshape(-1, 2)
        alike = np.flatnonzero(scales == scale)
        for faces in np.array_split(alike, max(-(-len(alike) * len(grid) // FRAGMENTS), 1)):
            places = low[faces, None] + grid
            x, y = np.moveaxis(places + 0.5 - corners[faces, None, 0, :2], -1, 0)
            u = (x * second[faces, None, 1] - y * second[faces, None, 0]) / area[faces, None]
            v = (y * first[faces, None, 0] - x * first[faces, None, 1]) / area[faces, None]
            weights = np.stack([1.0 - u - v, u, v], axis=-1)
            which, sample = np.nonzero((weights >= -1e-6).all(axis=-1))
            weights, places = weights[which, sample], places[which, sample]
            depth = (weights * corners[faces[which], :, 2]).sum(axis=1)
            tint = None if colors is None else np.einsum("mc,mcx->mx", weights, colors[faces[which]])
            yield places[:, 0], places[:, 1], depth, tint


def _of_discs(
    centres: Floats, radius: float, colors: Floats | None
) -> Iterator[tuple[Ints, Ints, Floats, Floats | None]]:
    """Columns, rows, nearness and colours of the samples in discs around centres (N, 3)."""
    reach = int(np.ceil(radius))
    grid = np.stack(np.meshgrid(*2 * [np.arange(-reach, reach + 1)]), axis=-1).reshape(-1, 2)
    grid = grid[np.linalg.norm(grid, axis=1) <= radius]
    for part in np.array_split(np.arange(len(centres)), max(-(-len(centres) * len(grid) // FRAGMENTS), 1)):
        places = (np.floor(centres[part, None, :2]).astype(int) + grid).reshape(-1, 2)
        tint = None if colors is None else np.repeat(colors[part], len(grid), axis=0)
        yield places[:, 0], places[:, 1], np.repeat(centres[part, 2], len(grid)), tint


def _radius(geometry: Geometry, view: View) -> float:
    """Samples of a disc with which the points of a surface nearly touch."""
    points = np.asarray(geometry.points, dtype=float)
    spacing = np.ptp(points, axis=0).max(initial=0.0) * np.sqrt(2.0 / max(len(points), 1))
    return max(0.7 * spacing * view.size[1] * SAMPLES / view.height, 0.5 * SAMPLES)


def _colors(geometry: Geometry, view: View, color: tuple[int, int, int]) -> Floats:
    """Colours of the corners of faces (F, 3, 3), or of points (N, 3)."""
    if isinstance(geometry, GaussianSplats):
        return 255.0 * geometry.colors
    plain = np.asarray(color, dtype=float)
    if not isinstance(geometry, Mesh):
        return np.tile(plain, (len(geometry.points), 1))
    normals = vertex_normals(np.asarray(geometry.points, dtype=float), geometry.faces) @ view.axes.T
    own = plain if geometry.colors is None else geometry.colors.astype(float)
    return _lit(own, normals[geometry.faces])


def _lit(colors: Floats, normals: Float[np.ndarray, "faces 3 3"]) -> Floats:
    """Colours under the light; both sides of a surface are lit."""
    facing = normals * np.where(normals[..., 2:] < 0.0, -1.0, 1.0)
    diffuse = np.clip(facing @ (LIGHT / np.linalg.norm(LIGHT)), 0.0, 1.0)[..., None]
    return np.clip(colors * (0.42 + 0.68 * diffuse) + 40.0 * diffuse**24, 0.0, 255.0)
