from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from odeform.dataset import store
from odeform.dataset.folder import folder_reader, save_sequence, write_index
from odeform.dataset.index import Dataset, Entry
from odeform.dataset.packed import pack
from odeform.dataset.recorded import read_recorded
from odeform.dataset.store import bundled_datasets, open_dataset
from odeform.errors import InputError
from odeform.simulation.scenes.registry import get_scene
from odeform.types import MotionSequence


@pytest.fixture
def dataset(tmp_path: Path) -> Dataset:
    """Three still tetrahedra in a folder."""
    root, schema = tmp_path / "folder", get_scene("kick").schema
    vertices = np.tile(np.eye(4, 3, dtype=np.float32), (5, 1, 1))
    still = MotionSequence(np.arange(5) / 120.0, vertices, np.array([[0, 1, 2]]), np.full(4, 0.25))
    names = [f"kick_{k:05d}" for k in range(3)]
    entries = [Entry(name, "train", {"mass": 0.6}, save_sequence(root, name, still)) for name in names]
    dataset = Dataset(root, schema, tuple(entries), folder_reader(root))
    write_index(dataset)
    return dataset


@pytest.fixture
def shipped(dataset: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of assets that holds the kicks, packed, and a file of another kind."""
    monkeypatch.setattr(store, "bundled", lambda kind: tmp_path / "assets" / kind)
    few = replace(dataset, entries=dataset.entries[:2])
    pack(few, tmp_path / "assets" / "datasets" / "kick.odp", tolerance=1e-3)
    (tmp_path / "assets" / "datasets" / "README.md").write_text("kicks")
    return tmp_path / "assets" / "datasets"


def test_finds_what_is_bundled(shipped: Path) -> None:
    assert bundled_datasets() == {"kick": shipped / "kick.odp"}
    assert open_dataset("kick") == open_dataset(shipped / "kick.odp")
    assert [e.name for e in open_dataset("kick").entries] == ["kick_00000", "kick_00001"]


def test_nothing_need_be_bundled(shipped: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "bundled", lambda kind: tmp_path / "nowhere")
    assert bundled_datasets() == {}
    with pytest.raises(InputError, match="kick"):
        open_dataset("kick")


def test_opens_folders_and_files(dataset: Dataset, shipped: Path) -> None:
    for name in (dataset.root, str(dataset.root)):
        assert open_dataset(name) == dataset
    assert open_dataset(str(shipped / "kick.odp")).root == shipped / "kick.odp"
    with pytest.raises(InputError, match=r"dataset\.json"):
        open_dataset(shipped)


def test_files_of_ones_own_are_imported_first(tmp_path: Path) -> None:
    (tmp_path / "own.npz").touch()
    with pytest.raises(InputError, match=r"expected DATASET/NAME, .*odeform import"):
        read_recorded(f"{tmp_path}/own.npz")
