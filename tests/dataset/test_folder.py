import hashlib
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from odeform.dataset.folder import folder_reader, open_folder, save_sequence, write_index
from odeform.dataset.index import Dataset, Entry
from odeform.errors import InputError
from odeform.simulation.scenes.registry import get_scene
from odeform.types import MotionSequence


def sequence(seed: int = 0) -> MotionSequence:
    vertices = np.random.default_rng(seed).normal(size=(5, 4, 3)).astype(np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    return MotionSequence(np.arange(5) / 10.0, vertices, faces, np.full(4, 0.25))


@pytest.fixture
def small(tmp_path: Path) -> Dataset:
    """Three sequences, of which the simulator gave up one."""
    entries = [
        Entry(f"s{k}", split, {"mass": 0.5}, save_sequence(tmp_path, f"s{k}", sequence(k)))
        for k, split in enumerate(("train", "train", "test"))
    ]
    entries[1] = replace(entries[1], status="diverged")
    dataset = Dataset(
        tmp_path, get_scene("kick").schema, tuple(entries), folder_reader(tmp_path), {"radius_m": 0.1}, {"seed": 3}
    )
    write_index(dataset)
    return dataset


def test_comes_back_as_written(small: Dataset) -> None:
    again = open_folder(small.root)
    assert again == small
    read, true = again.read(again.entries[2]), sequence(2)
    assert read.name == "s2"
    assert read.parameters == {"mass": 0.5}
    for name in ("times", "vertices", "faces", "weights"):
        assert np.array_equal(getattr(read, name), getattr(true, name))
    assert read.vertices.dtype == np.float32


def test_splits_leave_out_what_failed(small: Dataset) -> None:
    assert [e.name for e in small.select("train")] == ["s0"]
    assert [e.name for e in small.select("val")] == []
    assert [s.name for s in small.sequences("all")] == ["s0", "s2"]
    with pytest.raises(InputError, match="split"):
        small.select("tset")


def test_changed_files_are_noticed(small: Dataset) -> None:
    path = small.root / "s0.npz"
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    with pytest.raises(InputError, match="checksum"):
        small.read(small.entries[0])
    path.write_bytes(data[:100])
    with pytest.raises(InputError, match="checksum"):
        small.read(small.entries[0])
    path.unlink()
    with pytest.raises(InputError, match="No such file"):
        small.read(small.entries[0])


def test_nothing_is_unpickled(small: Dataset) -> None:
    path = small.root / "s0.npz"
    np.savez(path, times=np.array([{"a": 1}], dtype=object))
    entry = replace(small.entries[0], sha256=hashlib.sha256(path.read_bytes()).hexdigest())
    with pytest.raises(ValueError, match="pickle"):
        small.read(entry)


DAMAGE: dict[str, Callable[[dict[str, Any]], Any]] = {
    "another format": lambda index: {**index, "format": 2},
    "no format": lambda index: {k: v for k, v in index.items() if k != "format"},
    "a list": lambda index: [index],
    "a number": lambda index: 7,
    "no schema": lambda index: {k: v for k, v in index.items() if k != "schema"},
    "no sequences": lambda index: {k: v for k, v in index.items() if k != "sequences"},
    "strange entry": lambda index: {**index, "sequences": [{"name": "s0", "color": "red"}]},
    "strange name": lambda index: {**index, "sequences": [{**index["sequences"][0], "name": "s\0"}]},
    "a list of parameters": lambda index: {
        **index,
        "sequences": [{**index["sequences"][0], "parameters": list(index["sequences"][0]["parameters"])}],
    },
    "strange schema": lambda index: {**index, "schema": {**index["schema"], "window": {"start": 0.0}}},
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_refuses_an_index(small: Dataset, damage: str) -> None:
    path = small.root / "dataset.json"
    path.write_text(json.dumps(DAMAGE[damage](json.loads(path.read_text()))))
    with pytest.raises(InputError):
        open_folder(small.root)


def test_refuses_what_is_no_index(small: Dataset, tmp_path: Path) -> None:
    path = small.root / "dataset.json"
    for content in (b"", b"{", b"\xff\xfe\x00", path.read_bytes()[:-20]):
        path.write_bytes(content)
        with pytest.raises(InputError):
            open_folder(small.root)
    with pytest.raises(InputError, match=r"dataset\.json"):
        open_folder(tmp_path / "nowhere")
