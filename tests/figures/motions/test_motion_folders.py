"""Folders of mesh frames are what `odeform import` reads."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from odeform.dataset.importers.registry import import_dataset
from odeform.dataset.index import Dataset
from odeform_figures.motions.folder import write_folder
from odeform_figures.motions.registry import KINDS

FEW = replace(KINDS["pendulum"], sequences=8, frames=12)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    folder = tmp_path_factory.mktemp("motions")
    write_folder(FEW, folder / "frames", seed=3)
    return import_dataset(folder / "frames", folder / "data")


def test_what_is_imported_is_what_was_made(dataset: Dataset) -> None:
    draws = FEW.draws(3)
    assert [entry.parameters for entry in dataset.entries] == [pytest.approx(row) for row in draws]
    assert {p.name: p.unit for p in dataset.schema.parameters} == FEW.units
    read = dataset.read(dataset.entries[2])
    made, faces = FEW.move(draws[2], FEW.times)
    np.testing.assert_allclose(read.vertices, made, atol=1e-5)
    np.testing.assert_array_equal(read.faces, faces)
    np.testing.assert_allclose(read.times, FEW.times)


def test_every_split_has_sequences(dataset: Dataset) -> None:
    assert [len(dataset.select(split)) for split in ("train", "val", "test")] == [6, 1, 1]


def test_a_folder_that_exists_is_refused(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "odeform_figures.motions", "throw", "--out", str(tmp_path)]
    found = subprocess.run(command, capture_output=True, text=True, env=dict(os.environ), check=False)
    assert found.returncode == 2
    assert "exists" in found.stderr
    assert not list(tmp_path.iterdir())
