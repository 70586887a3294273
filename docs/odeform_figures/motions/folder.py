"""A kind of motion as a folder of mesh frames with a table, as `odeform import` reads it."""

import csv
import io
from collections.abc import Callable
from pathlib import Path

from odeform.formats.writing import write_shape
from odeform.io import atomic_write
from odeform.types import Mesh
from odeform_figures.motions.kind import Kind

__all__ = ["write_folder"]

SPLITS = ("train", "train", "train", "val", "train", "train", "test", "train", "train", "train",
          "train", "test", "train", "train", "val", "train", "train", "test", "train", "train")  # fmt: skip
"""Splits every twenty sequences: 15 train, 2 val, 3 test."""


def write_folder(kind: Kind, out: Path, seed: int = 0, report: Callable[[str], None] = lambda line: None) -> None:
    """Write all sequences of `kind` as `.ply` frames, and `parameters.csv`, to the new folder `out`."""
    out.mkdir(parents=True)
    table = io.StringIO()
    rows = csv.writer(table)
    columns = [f"{name} ({unit})" if unit else name for name, unit in kind.units.items()]
    rows.writerow(["sequence", *columns, "split", "rate"])
    for index, parameters in enumerate(kind.draws(seed)):
        name = f"motion_{index:03d}"
        vertices, faces = kind.move(parameters, kind.times)
        (out / name).mkdir()
        for frame, points in enumerate(vertices):
            write_shape(Mesh(points.astype("float32"), faces), out / name / f"frame_{frame:03d}.ply")
        rows.writerow([name, *parameters.values(), SPLITS[index % len(SPLITS)], kind.rate])
        report(f"{name}: {len(vertices)} frames")
    atomic_write(out / "parameters.csv", table.getvalue().encode())
