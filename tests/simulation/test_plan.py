"""Data sets of scenes with several objects, and data sets that grow. The simulation is replaced by a formula."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from odeform.cli import main
from odeform.dataset.index import Dataset
from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.schema import Parameters
from odeform.simulation import runner
from odeform.simulation.plan import plan
from odeform.simulation.runner import simulate
from odeform.simulation.scene import Scene
from odeform.simulation.scenes import kick
from odeform.types import MotionSequence

OBJECTS = ("cat", "flip-flop", "dog")
FLIP_FLOPS = ["kick_flip-flop_00000", "kick_flip-flop_00001"]


def still(parameters: Parameters, rate: float, step: float) -> MotionSequence:
    count = {"cat": 4, "dog": 5, "flip-flop": 6}.get(parameters.get("object", ""), 3)
    vertices = np.full((3, count, 3), parameters["mass"])
    return MotionSequence(np.arange(3) / rate, vertices, np.array([[0, 1, 2]]), np.full(count, 1.0 / count))


@pytest.fixture
def scene(monkeypatch: pytest.MonkeyPatch) -> Scene:
    """`kick` with three objects and 30 sequences of each."""
    changed = replace(kick.SCENE, schema=replace(kick.SCHEMA, objects=OBJECTS), simulate=still, count=30)
    monkeypatch.setattr(kick, "SCENE", changed)
    return changed


@pytest.fixture
def balls(monkeypatch: pytest.MonkeyPatch) -> None:
    """`kick` as it is, with 10 sequences."""
    monkeypatch.setattr(kick, "SCENE", replace(kick.SCENE, simulate=still, count=10))


def of(dataset: Dataset, name: str) -> list[tuple]:
    return [(e.name, e.split, e.parameters) for e in dataset.entries if e.parameters["object"] == name]


def test_each_object_has_the_count_and_its_own_mesh(scene: Scene, tmp_path: Path) -> None:
    made = simulate("kick", tmp_path, count=20)
    assert made.objects == OBJECTS
    assert [e.name for e in made.entries[19:21]] == ["kick_cat_00019", "kick_flip-flop_00000"]
    assert {e.name: made.read(e).vertices.shape[1] for e in made.entries[::20]} == {
        "kick_cat_00000": 4,
        "kick_flip-flop_00000": 6,
        "kick_dog_00000": 5,
    }
    assert Counter((e.split, e.parameters["object"]) for e in made.entries) == {
        (split, name): share for name in OBJECTS for split, share in (("train", 14), ("val", 2), ("test", 4))
    }
    assert [e.name for e in made.select("val", "dog")] == [e.name for e in made.select("val") if "dog" in e.name]
    assert [s.parameters["object"] for s in made.sequences("val", "dog")] == ["dog", "dog"]
    with pytest.raises(InputError, match="unknown object 'cow'"):
        made.select("all", "cow")


def test_an_object_does_not_depend_on_the_others(scene: Scene, tmp_path: Path) -> None:
    every = simulate("kick", tmp_path / "every", count=5)
    one = simulate("kick", tmp_path / "one", count=5, objects=["dog"])
    assert one.objects == ("dog",)
    assert of(one, "dog") == of(every, "dog")


def test_a_longer_plan_starts_with_the_shorter(scene: Scene) -> None:
    """Beyond the standard count all sequences are for training."""
    plans = {count: plan(scene, count, 0, ["cat"]) for count in (7, 30, 41)}
    assert plans[41][:30] == plans[30]
    assert plans[30][:7] == plans[7]
    assert Counter(e.split for e in plans[30]) == {"train": 21, "val": 3, "test": 6}
    assert {e.split for e in plans[41][30:]} == {"train"}


def test_a_data_set_grows_and_keeps_its_sequences(scene: Scene, tmp_path: Path) -> None:
    small = simulate("kick", tmp_path, count=5, objects=["dog"])
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.glob("*.npz")}
    large = simulate("kick", tmp_path, count=8, objects=["dog", "cat"])
    assert all(path.stat().st_mtime_ns == time for path, time in kept.items())
    assert large.objects == ("cat", "dog")
    assert of(large, "dog")[:5] == of(small, "dog")
    assert large.provenance["count"] == {"cat": 8, "dog": 8}
    other = simulate("kick", tmp_path, count=2, objects=["flip-flop"])
    assert other.provenance["count"] == {"cat": 8, "dog": 8, "flip-flop": 2}
    assert len(other.entries) == 18
    assert open_dataset(tmp_path) == other
    with pytest.raises(InputError, match="another data set"):
        simulate("kick", tmp_path, count=7)
    with pytest.raises(InputError, match="another data set"):
        simulate("kick", tmp_path, count=8, seed=1)


@pytest.mark.usefixtures("balls")
def test_a_complete_data_set_of_one_body_grows_by_training_data(tmp_path: Path) -> None:
    made = simulate("kick", tmp_path, count=10)
    larger = simulate("kick", tmp_path, count=14)
    assert larger.entries[:10] == made.entries
    assert {e.split for e in larger.entries[10:]} == {"train"}


@pytest.mark.usefixtures("balls")
def test_a_small_data_set_of_one_body_cannot_grow(tmp_path: Path) -> None:
    """Its splits would change, and test sequences have other frame rates."""
    simulate("kick", tmp_path, count=6)
    with pytest.raises(InputError, match="expected a count of at least 6 that keeps its splits"):
        simulate("kick", tmp_path, count=10)


def test_what_was_simulated_before_an_interruption_is_kept(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = [4]

    def interrupted(parameters: Parameters, rate: float, step: float) -> MotionSequence:
        left[0] -= 1
        if left[0] < 0:
            raise KeyboardInterrupt
        return still(parameters, rate, step)

    monkeypatch.setattr(kick, "SCENE", replace(scene, simulate=interrupted))
    with pytest.raises(KeyboardInterrupt):
        simulate("kick", tmp_path, count=2)
    assert [e.name for e in open_dataset(tmp_path).entries] == ["kick_cat_00000", "kick_cat_00001", *FLIP_FLOPS]
    monkeypatch.setattr(kick, "SCENE", scene)
    assert len(simulate("kick", tmp_path, count=2).entries) == 6


def test_a_scene_with_a_sampler_of_its_own(scene: Scene) -> None:
    """Draws are completed and checked; each names its object."""

    def sampler(name: str, count: int, seed: int) -> list[dict]:
        return [{"mass": 0.5 + 0.01 * len(name) + 0.001 * (seed + index)} for index in range(count)]

    drawn = replace(scene, sampler=sampler).sample(2, seed=1, objects=["dog", "cat"])
    assert [row["object"] for row in drawn] == ["dog", "dog", "cat", "cat"]
    assert [round(row["mass"], 3) for row in drawn] == [0.531, 0.532, 0.531, 0.532]
    assert list(drawn[0]) == ["object", "mass", "bending", "force", "azimuth", "elevation"]


def test_objects_on_the_command_line(scene: Scene, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["simulate", "kick", "--out", str(tmp_path), "--count", "2", "--workers", "1"]
    assert main([*command, "--object", "dog", "cat"]) == 0
    assert capsys.readouterr().out == f"4 sequences in {tmp_path}; failed: none\n"
    assert main([*command, "--object", "cow"]) == 2
    assert "unknown object 'cow': scene kick has cat, flip-flop, dog" in capsys.readouterr().err
    assert main([*command, "--corners"]) == 2
    assert "no corners" in capsys.readouterr().err


@pytest.fixture
def index_writes(monkeypatch: pytest.MonkeyPatch) -> Callable[[], int]:
    """Counts how often the index is written."""
    written, write = [], runner.write_index
    monkeypatch.setattr(runner, "write_index", lambda dataset: (written.append(len(dataset.entries)), write(dataset)))
    return lambda: len(written)


def test_the_index_takes_a_small_share_of_the_time(
    scene: Scene, tmp_path: Path, index_writes: Callable[[], int]
) -> None:
    """Simulations that take no time finish between few writes; the last one has all entries."""
    simulate("kick", tmp_path, count=40)
    assert 2 <= index_writes() < 60
    assert len(open_dataset(tmp_path).entries) == 120
