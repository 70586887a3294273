"""The picture of the seven objects in the documentation: `python -m odeform.simulation.objects.picture FILE`."""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from odeform.geometry.normals import vertex_normals
from odeform.simulation.objects.catalog import OBJECTS, get_object
from odeform.types import Floats, Mesh

__all__ = ["draw", "main"]

SIZE, SAMPLES = 300, 2  # pixels of a tile; samples of a pixel along each axis
AZIMUTH, ELEVATION = np.radians(-38.0), np.radians(26.0)  # of the eye
LIGHT = np.array([-0.35, 0.55, 0.75])  # in the picture's axes: right, up, towards the eye
PAPER, SHADOW = 250.0, 0.86
COLORS = {
    "bottle": (96, 165, 205),
    "cat": (232, 156, 92),
    "dog": (176, 128, 92),
    "donut": (226, 148, 170),
    "chip": (238, 176, 70),
    "flip-flop": (88, 178, 150),
    "pillow": (150, 148, 214),
}


def draw(mesh: Mesh, color: Sequence[float]) -> Floats:
    """(SIZE, SIZE, 3) bytes: the mesh on a floor with its shadow, filling the tile."""
    a, e = AZIMUTH, ELEVATION
    view = np.array(
        [
            [-np.sin(a), np.cos(a), 0.0],
            [-np.cos(a) * np.sin(e), -np.sin(a) * np.sin(e), np.cos(e)],
            [np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)],
        ]
    )
    points = np.asarray(mesh.points, dtype=float)
    turned, count = points @ view.T, SIZE * SAMPLES
    middle = 0.5 * (turned.min(axis=0) + turned.max(axis=0))
    scale = 0.8 * count / np.ptp(turned[:, :2], axis=0).max()
    # towards +z nothing moves: the shadow is that of a lamp above
    flat = (points * [1.0, 1.0, 0.0]) @ view.T
    image = np.full((count, count, 3), PAPER)
    for positions, normals in ((flat, None), (turned, vertex_normals(points, mesh.faces) @ view.T)):
        pixels = (positions[:, :2] - middle[:2]) * scale * [1.0, -1.0] + 0.5 * count
        _fill(image, pixels, positions[:, 2], mesh, None if normals is None else _shaded(normals, color))
    return image.reshape(SIZE, SAMPLES, SIZE, SAMPLES, 3).mean(axis=(1, 3)).astype(np.uint8)


def _shaded(normals: Floats, color: Sequence[float]) -> Floats:
    """(N, 3) colours of vertices; both sides of a surface are lit."""
    facing = normals * np.where(normals[:, 2:] < 0.0, -1.0, 1.0)
    diffuse = np.clip(facing @ (LIGHT / np.linalg.norm(LIGHT)), 0.0, 1.0)[:, None]
    return np.clip(np.asarray(color, dtype=float) * (0.42 + 0.68 * diffuse) + 40.0 * diffuse**24, 0.0, 255.0)


def _fill(image: Floats, pixels: Floats, depth: Floats, mesh: Mesh, colors: Floats | None) -> None:
    """Rasterise the triangles with a depth buffer; without `colors` they are a shadow."""
    buffer = np.full(image.shape[:2], -np.inf)
    for face in mesh.faces:
        corners = pixels[face]
        low = np.maximum(np.floor(corners.min(axis=0)).astype(int), 0)
        high = np.minimum(np.ceil(corners.max(axis=0)).astype(int) + 1, image.shape[0])
        first, second = corners[1] - corners[0], corners[2] - corners[0]
        area = first[0] * second[1] - first[1] * second[0]
        if abs(area) < 1e-9 or (high <= low).any():
            continue
        x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
        x, y = x - corners[0, 0], y - corners[0, 1]
        u, v = (x * second[1] - y * second[0]) / area, (y * first[0] - x * first[1]) / area
        weights = np.stack([1.0 - u - v, u, v], axis=-1)
        tile = (slice(low[1], high[1]), slice(low[0], high[0]))
        near = weights @ depth[face]
        hit = (weights >= -1e-6).all(axis=-1) & (near > buffer[tile])
        buffer[tile][hit] = near[hit]
        image[tile][hit] = SHADOW * PAPER if colors is None else (weights @ colors[face])[hit]


def main(argv: Sequence[str] | None = None) -> None:
    """Draw the seven objects in two rows."""
    parser = argparse.ArgumentParser(prog="python -m odeform.simulation.objects.picture")
    parser.add_argument("file", metavar="FILE", type=Path, help="picture to write, such as docs/pictures/objects.webp")
    path = parser.parse_args(argv).file
    tiles = [draw(get_object(name).rest_mesh(), COLORS[name]) for name in OBJECTS]
    blank = np.full((SIZE, SIZE // 2, 3), int(PAPER), np.uint8)
    rows = [np.concatenate(tiles[:4], axis=1), np.concatenate([blank, *tiles[4:], blank], axis=1)]
    Image.fromarray(np.concatenate(rows)).save(path, quality=88)


if __name__ == "__main__":
    main()
