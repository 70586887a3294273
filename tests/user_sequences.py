"""Small motions in folders of frames with a table, and what the importer makes of them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from authors import TETRAHEDRON

from odeform.dataset.importers.registry import import_dataset
from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.types import MotionSequence

__all__ = [
    "CORNERS",
    "TABLE",
    "WITHOUT_RATE",
    "Frame",
    "folder",
    "heights",
    "imported",
    "obj",
    "refused",
    "refused_all",
    "shape",
    "stl",
]

CORNERS = 0.1 * np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
TABLE = "sequence,mass (kg),rate\na,0.5,10\nb,0.8,10\n"
WITHOUT_RATE = "sequence,mass (kg)\na,0.5\nb,0.8\n"
Frame = Callable[[Path, np.ndarray], None]


def shape(height: float) -> np.ndarray:
    """A tetrahedron that is lifted and stretched."""
    return CORNERS * (1.0 + 0.1 * height) + [0.0, 0.0, height]


def obj(path: Path, points: np.ndarray) -> None:
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points]
    path.write_text("\n".join(lines + ["f " + " ".join(map(str, face)) for face in TETRAHEDRON + 1]))


def stl(path: Path, points: np.ndarray) -> None:
    trimesh.Trimesh(points, TETRAHEDRON, process=False).export(path)


def folder(root: Path, names: list[str], heights: list[float], write: Frame = obj, table: str = TABLE) -> Path:
    """Two sequences of the same frames, and a table."""
    for name in ("a", "b"):
        (root / name).mkdir(parents=True)
        for frame, height in zip(names, heights, strict=True):
            write(root / name / frame, shape(height))
    (root / "parameters.csv").write_text(table)
    return root


def imported(root: Path, rate: float | None = None, unit: str = "m") -> tuple[Dataset, MotionSequence]:
    dataset = import_dataset(root, root.parent / "out", rate, unit=unit)
    return dataset, next(sequence for sequence in dataset.sequences("all") if sequence.name == "a")


def heights(sequence: MotionSequence) -> list[float]:
    return [round(float(z), 4) for z in sequence.vertices[:, 0, 2]]


def refused(root: Path, message: str, rate: float | None = None) -> None:
    with pytest.raises(InputError, match=message):
        imported(root, rate)
    assert not (root.parent / "out/dataset.json").exists()


def refused_all(root: Path, message: str) -> None:
    """No sequence can be read, the first for the reason of the message."""
    with pytest.raises(InputError, match=f"none of 2 sequences can be read; .*{message}"):
        imported(root)
