from dataclasses import replace
from pathlib import Path

import pytest

from odeform.dataset import store
from odeform.dataset.index import Dataset
from odeform.dataset.packed import pack
from odeform.dataset.store import bundled_datasets, open_dataset
from odeform.errors import InputError


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
