import json
import shutil
from pathlib import Path

import pytest

from odeform.dataset.store import Dataset, open_dataset
from odeform.errors import InputError
from odeform.simulation.runner import simulate_dataset


def test_resumes_to_the_same_data_with_other_workers(dataset: Dataset, tmp_path: Path) -> None:
    """Two workers made the data set; one makes again what an interruption lost, bit for bit."""
    root = tmp_path / "kick"
    shutil.copytree(dataset.root, root)
    index = json.loads((root / "dataset.json").read_text())
    lost = [index["sequences"].pop(row)["name"] for row in (12, 4)]
    (root / "dataset.json").write_text(json.dumps(index))
    for name in lost:
        (root / f"{name}.npz").unlink()
    kept = {path: path.stat().st_mtime_ns for path in root.glob("*.npz")}
    made = dataset.provenance
    again = simulate_dataset("kick", root, made["count"], made["seed"], workers=1, step=made["step_s"])
    assert len(kept) == made["count"] - 2
    assert all(path.stat().st_mtime_ns == time for path, time in kept.items())
    assert again.entries == dataset.entries
    assert open_dataset(root).entries == dataset.entries
    assert (root / "dataset.json").read_text() == (dataset.root / "dataset.json").read_text()


def test_refuses_a_folder_with_another_data_set(dataset: Dataset) -> None:
    with pytest.raises(InputError, match="another data set"):
        simulate_dataset("kick", dataset.root, dataset.provenance["count"], seed=99)


def test_unknown_scene(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="kick"):
        simulate_dataset("throw", tmp_path, count=1)
