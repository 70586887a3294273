import hashlib
import json
import pickle
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import safetensors.numpy
import safetensors.torch
import torch

from odeform.arrays import STEP, in_steps
from odeform.checkpoint import Checkpoint, read_checkpoint, resolve_checkpoint, write_checkpoint
from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.models.names import ALIASES
from odeform.models.registry import load
from odeform.simulation.scenes.registry import get_scene

MODELS = ("odeform", "pod-rbf", "nearest")


def small() -> Checkpoint:
    return Checkpoint(
        model="nearest",
        schema=get_scene("kick").schema,
        config={"answer": 42, "list": [1.5, None]},
        arrays={"a": np.arange(6.0).reshape(2, 3).T, "b": np.array([1, 2], dtype=np.int32), "c": np.zeros((0, 3))},
        provenance={"seed": 1},
        scores={"rmse_mm": 0.25},
    )


def rewritten(source: Path, target: Path, change: Callable[[dict[str, str]], dict[str, str]]) -> Path:
    """A copy of a checkpoint with its metadata changed."""
    data = source.read_bytes()
    header = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])
    target.write_bytes(safetensors.numpy.save(safetensors.numpy.load(data), change(header["__metadata__"])))
    return target


def test_comes_back_as_written(tmp_path: Path) -> None:
    path = tmp_path / "new" / "a.safetensors"
    write_checkpoint(path, small())
    again = read_checkpoint(path)
    for name in ("model", "schema", "config", "provenance", "scores"):
        assert getattr(again, name) == getattr(small(), name)
    assert again.arrays.keys() == small().arrays.keys()
    for name, array in small().arrays.items():
        assert np.array_equal(again.arrays[name], array)
        assert again.arrays[name].dtype == array.dtype
    assert again.size_bytes == path.stat().st_size
    assert again.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert list(path.parent.iterdir()) == [path]


def test_failed_write_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "a.safetensors"
    write_checkpoint(path, small())
    before = path.read_bytes()
    with pytest.raises(TypeError):
        write_checkpoint(path, replace(small(), config={"unserialisable": object()}))
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("model", MODELS)
def test_a_reloaded_model_predicts_the_same(
    trained: dict[str, Path], predictors: dict[str, Predictor], model: str, tmp_path: Path
) -> None:
    write_checkpoint(tmp_path / "copy.safetensors", read_checkpoint(trained[model]))
    again = load(tmp_path / "copy.safetensors")
    assert isinstance(again, Predictor)
    assert again.model == ALIASES.get(model, model)
    times = np.linspace(0.0, 1.2, 7)
    assert np.array_equal(again.solve().vertices(times), predictors[model].solve().vertices(times))


@pytest.mark.parametrize(("largest", "bytes_each"), [(65535, 2), (65536, 4)])
def test_indices_take_two_bytes_where_they_fit(tmp_path: Path, largest: int, bytes_each: int) -> None:
    faces = np.array([[0, 1, largest]], dtype=np.int32)
    other = np.array([7, 8], dtype=np.int32)
    arrays = {**small().arrays, "rest.faces": faces, "counts": other}
    write_checkpoint(path := tmp_path / "a.safetensors", replace(small(), arrays=arrays))
    assert safetensors.numpy.load(path.read_bytes())["rest.faces"].dtype.itemsize == bytes_each
    read = read_checkpoint(path).arrays
    for name, array in (("rest.faces", faces), ("counts", other)):
        assert read[name].dtype == np.int32
        assert np.array_equal(read[name], array)


@pytest.mark.parametrize("keep", [0, 4, 8, 100, -1, -1000])
def test_truncated(trained: dict[str, Path], tmp_path: Path, keep: int) -> None:
    path = tmp_path / "cut.safetensors"
    path.write_bytes(trained["nearest"].read_bytes()[:keep])
    with pytest.raises(InputError, match="truncated"):
        load(path)


def foreign() -> dict[str, bytes]:
    return {
        "pickle": pickle.dumps({"weights": [1.0]}),
        "text": b"{}",
        "huge header": (2**63).to_bytes(8, "little") + b"{}",
        "without metadata": safetensors.numpy.save({"a": np.zeros(3)}),
        "of another": safetensors.numpy.save({"a": np.zeros(3)}, {"format": "pt"}),
        "of a later format": safetensors.numpy.save({"a": np.zeros(3)}, {"odeform": "2"}),
        "bfloat16": safetensors.torch.save({"a": torch.zeros(3, dtype=torch.bfloat16)}),
    }


@pytest.mark.parametrize("kind", foreign())
def test_foreign_files(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "foreign.safetensors"
    path.write_bytes(foreign()[kind])
    with pytest.raises(InputError, match=r"foreign\.safetensors"):
        load(path)


Metadata = dict[str, str]


def meta(**changes: Any) -> Callable[[Metadata], Metadata]:
    return lambda metadata: {"odeform": json.dumps({**json.loads(metadata["odeform"]), **changes})}


def without(key: str) -> Callable[[Metadata], Metadata]:
    def change(metadata: Metadata) -> Metadata:
        return {"odeform": json.dumps({k: v for k, v in json.loads(metadata["odeform"]).items() if k != key})}

    return change


DAMAGE: dict[str, Callable[[Metadata], Metadata]] = {
    "no scores": without("scores"),
    "no model": without("model"),
    "another format": meta(format=2),
    "unknown model": meta(model="oracle"),
    "model of other arrays": meta(model="odeform"),
    "not JSON": lambda _: {"odeform": "{"},
    "not an object": lambda _: {"odeform": "[]"},
    "schema without fields": meta(schema={}),
    "schema of a wrong type": meta(schema=7),
    "config without fields": meta(config={}),
    "config of a wrong type": meta(config=[1]),
    "words for numbers": meta(config={"space": {"anchor": [0, 0, 0], "arm": "long", "basis_scale": 1.0}}),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_damaged_metadata(trained: dict[str, Path], tmp_path: Path, damage: str) -> None:
    path = rewritten(trained["nearest"], tmp_path / "a.safetensors", DAMAGE[damage])
    with pytest.raises(InputError):
        load(path)


@pytest.mark.parametrize("model", MODELS)
def test_missing_space(trained: dict[str, Path], tmp_path: Path, model: str) -> None:
    whole = read_checkpoint(trained[model])
    for missing in ("basis.values", "rest.points"):
        arrays = {name: array for name, array in whole.arrays.items() if name != missing}
        write_checkpoint(tmp_path / "a.safetensors", replace(whole, arrays=arrays))
        with pytest.raises(InputError, match=missing):
            load(tmp_path / "a.safetensors")


def in_file(path: Path) -> dict[str, np.ndarray]:
    """The arrays as the file itself has them."""
    return safetensors.numpy.load(path.read_bytes())


def test_arrays_in_steps_are_packed_in_the_file_alone(tmp_path: Path) -> None:
    values = np.random.default_rng(0).normal(size=(5, 40, 3))
    whole = replace(small(), arrays={**small().arrays, **in_steps("a", values, np.full(5, 1e-2))})
    write_checkpoint(tmp_path / "a.safetensors", whole)
    assert in_file(tmp_path / "a.safetensors")["a"].dtype == np.uint8
    again = read_checkpoint(tmp_path / "a.safetensors")
    assert again.arrays.keys() == whole.arrays.keys()
    assert np.array_equal(again.arrays["a"], whole.arrays["a"])
    write_checkpoint(tmp_path / "b.safetensors", again)
    assert (tmp_path / "a.safetensors").read_bytes() == (tmp_path / "b.safetensors").read_bytes()


PACKED_DAMAGE: dict[str, dict[str, Any]] = {
    "too large": {"a": [5, 1 << 40]},
    "of negative size": {"a": [-5, 120]},
    "of another shape": {"a": [5, 119]},
    "of words": {"a": ["five", 120]},
    "without dimensions": {"a": []},
    "of no array": {"z": [5, 120]},
    "without a step": {"b": [2]},
    "no table": [1],  # pyright: ignore[reportAssignmentType]
}


@pytest.mark.parametrize("damage", PACKED_DAMAGE)
def test_damaged_packed_arrays_are_refused(tmp_path: Path, damage: str) -> None:
    values = np.random.default_rng(0).normal(size=(5, 120))
    whole = replace(small(), arrays={**small().arrays, **in_steps("a", values, np.full(5, 1e-2))})
    write_checkpoint(tmp_path / "a.safetensors", whole)
    path = rewritten(tmp_path / "a.safetensors", tmp_path / "b.safetensors", meta(packed=PACKED_DAMAGE[damage]))
    with pytest.raises(InputError, match=r"checkpoint .*b\.safetensors"):
        read_checkpoint(path)


def test_files_of_before_arrays_were_packed_still_load(trained: dict[str, Path], tmp_path: Path) -> None:
    """They hold the weights of the basis in place of its values, and no steps."""
    whole = read_checkpoint(trained["nearest"])
    new = load(trained["nearest"])
    weights = new.space.basis.weights  # pyright: ignore[reportAttributeAccessIssue]
    kept = {k: v for k, v in whole.arrays.items() if not k.endswith(STEP) and k != "basis.values"}
    old = {**kept, "basis.weights": weights, "local": kept["local"].astype(np.float16)}
    write_checkpoint(tmp_path / "old.safetensors", replace(whole, arrays=old))
    assert all(array.dtype != np.uint8 for array in in_file(tmp_path / "old.safetensors").values())
    again = load(tmp_path / "old.safetensors").solve().vertices(np.linspace(0.0, 1.0, 5))
    assert np.abs(again - new.solve().vertices(np.linspace(0.0, 1.0, 5))).max() < 2e-5


def test_names(tmp_path: Path) -> None:
    path = tmp_path / "a.safetensors"
    write_checkpoint(path, small())
    assert resolve_checkpoint(str(path)) == path
    with pytest.raises(InputError, match="expected a file or one of the bundled"):
        resolve_checkpoint("throw/odeform")
    with pytest.raises(InputError):
        load(tmp_path)


@pytest.mark.parametrize("name", ["net.local_field.2.weight", "net.local_encoder.head.4.bias", "net.gains"])
def test_a_network_with_a_gap_is_refused(trained: dict[str, Path], tmp_path: Path, name: str) -> None:
    whole = read_checkpoint(trained["odeform"])
    arrays = {key: array for key, array in whole.arrays.items() if key != name}
    write_checkpoint(tmp_path / "gap.safetensors", replace(whole, arrays=arrays))
    with pytest.raises(InputError, match=name.removeprefix("net.")):
        load(tmp_path / "gap.safetensors")


def test_numpy_scalars_become_plain_values(tmp_path: Path) -> None:
    path, settings = tmp_path / "a.safetensors", {"ridge": np.float32(0.5), "counts": [np.int64(3)], "used": np.True_}
    write_checkpoint(path, replace(small(), config=settings))
    assert read_checkpoint(path).config == {"ridge": 0.5, "counts": [3], "used": True}
    with pytest.raises(TypeError, match="plain JSON values besides the arrays, got ndarray"):
        write_checkpoint(path, replace(small(), config={"ridge": np.ones(2)}))


def test_the_same_content_is_the_same_file(trained: dict[str, Path], tmp_path: Path) -> None:
    for name in ("one", "two"):
        write_checkpoint(tmp_path / name, read_checkpoint(trained["pod-rbf"]))
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()
