"""The picture of the seven objects in the documentation: `python -m odeform_figures.bodies.picture FILE`."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from odeform.formats.drawing import View, draw
from odeform.formats.picture_files import Picture
from odeform.simulation.objects.catalog import OBJECTS, get_object

__all__ = ["draw_object", "main"]

SIZE, FILLED = 300, 0.8  # pixels of a tile; fraction of it that the object takes
PAPER = 250
COLORS = {
    "bottle": (96, 165, 205),
    "cat": (232, 156, 92),
    "dog": (176, 128, 92),
    "donut": (226, 148, 170),
    "chip": (238, 176, 70),
    "flip-flop": (88, 178, 150),
    "pillow": (150, 148, 214),
}


def draw_object(name: str) -> Picture:
    """Draws an object on a plain floor, filling a tile of `SIZE` pixels."""
    mesh, view = get_object(name).rest_mesh(), View(np.zeros(3), 1.0, (SIZE, SIZE))
    seen = np.asarray(mesh.points, dtype=float) @ view.axes.T
    middle = 0.5 * (seen.min(axis=0) + seen.max(axis=0)) @ view.axes
    return draw(
        mesh, replace(view, target=middle, height=float(np.ptp(seen[:, :2], axis=0).max()) / FILLED), COLORS[name]
    )


def main(argv: Sequence[str] | None = None) -> None:
    """Draw the seven objects in two rows."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.bodies.picture")
    parser.add_argument("file", metavar="FILE", type=Path, help="picture to write, such as docs/pictures/objects.webp")
    path = parser.parse_args(argv).file
    tiles = [draw_object(name) for name in OBJECTS]
    blank = np.full((SIZE, SIZE // 2, 3), PAPER, np.uint8)
    rows = [np.concatenate(tiles[:4], axis=1), np.concatenate([blank, *tiles[4:], blank], axis=1)]
    Image.fromarray(np.concatenate(rows)).save(path, quality=88)


if __name__ == "__main__":
    main()
