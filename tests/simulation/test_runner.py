import json
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from odeform.cli import main
from odeform.dataset.index import Dataset
from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.schema import Parameters, Window
from odeform.simulation.errors import SimulationError
from odeform.simulation.runner import simulate
from odeform.simulation.scenes import kick
from odeform.simulation.scenes.registry import get_scene
from odeform.types import MotionSequence


@pytest.mark.slow
@pytest.mark.usefixtures("coarse")
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
    ranges = {name: tuple(span) for name, span in made["ranges"].items()}
    again = simulate("kick", root, made["count"], made["seed"], workers=1, ranges=ranges)
    assert len(kept) == made["count"] - 2
    assert all(path.stat().st_mtime_ns == time for path, time in kept.items())
    assert again.entries == dataset.entries
    assert open_dataset(root).entries == dataset.entries
    assert (root / "dataset.json").read_text() == (dataset.root / "dataset.json").read_text()


@pytest.mark.slow
def test_another_process_makes_the_same_data(tmp_path: Path) -> None:
    """With all vertices: what this process makes coarser, others do not."""
    made = simulate("kick", tmp_path, count=1, workers=2, rate=30.0, step=4e-3)
    again = get_scene("kick").simulate(made.entries[0].parameters, rate=30.0, step=4e-3)
    assert again.vertices.shape == (31, 402, 3)
    assert np.array_equal(made.read(made.entries[0]).vertices, again.vertices)


def test_test_sequences_have_four_times_the_frames(dataset: Dataset) -> None:
    for split, rate in (("train", 120.0), ("val", 120.0), ("test", 480.0)):
        sequences = list(dataset.sequences(split))
        assert sequences
        for sequence in sequences:
            assert np.allclose(sequence.times, np.arange(round(rate) + 1) / rate, rtol=0.0, atol=1e-12)
            assert len(sequence.vertices) == len(sequence.times)


@pytest.mark.slow
@pytest.mark.usefixtures("coarse")
def test_corners_are_for_training(tmp_path: Path) -> None:
    """Besides what is drawn, which stays as it was."""
    corners = get_scene("kick").schema.corners()
    drawn = simulate("kick", tmp_path / "drawn", count=1, rate=30.0, step=4e-3)
    with_corners = simulate("kick", tmp_path / "both", count=1, rate=30.0, step=4e-3, corners=True)
    assert with_corners.entries[:1] == drawn.entries
    assert [entry.parameters for entry in with_corners.entries[1:]] == corners
    assert {entry.split for entry in with_corners.entries[1:]} == {"train"}


@pytest.mark.slow
@pytest.mark.usefixtures("coarse")
def test_frames_of_a_rate_asked_for(tmp_path: Path) -> None:
    """The schema says it: what is learned and scored are frames of this rate."""
    made = simulate("kick", tmp_path, count=2, rate=30.0)
    assert made.schema.window == Window(0.0, 1.0, 30.0)
    assert open_dataset(tmp_path) == made
    assert {e.split: len(made.read(e).times) for e in made.entries} == {"train": 31, "test": 121}


def test_what_failed_is_listed_and_left_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tried = []

    def fragile(parameters: Parameters, rate: float, step: float) -> MotionSequence:
        tried.append(parameters)
        if len(tried) == 2:
            raise SimulationError("it broke")
        return MotionSequence(np.arange(3) / rate, np.zeros((3, 4, 3)), np.array([[0, 1, 2]]), np.full(4, 0.25))

    monkeypatch.setattr(kick, "SCENE", replace(kick.SCENE, simulate=fragile))
    made = simulate("kick", tmp_path, count=3)
    assert [e.status for e in made.entries] == ["ok", "it broke", "ok"]
    assert [e.name for e in made.select("all")] == ["kick_00000", "kick_00002"]
    assert sorted(path.name for path in tmp_path.glob("*.npz")) == ["kick_00000.npz", "kick_00002.npz"]
    assert simulate("kick", tmp_path, count=3) == made
    assert len(tried) == 3


def test_an_unexpected_error_ends_one_sequence_and_is_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = True

    def fragile(parameters: Parameters, rate: float, step: float) -> MotionSequence:
        if broken and parameters == first:
            raise ZeroDivisionError("no time at all")
        return MotionSequence(np.arange(3) / rate, np.zeros((3, 4, 3)), np.array([[0, 1, 2]]), np.full(4, 0.25))

    first = kick.SCENE.sample(3, 0)[0]
    monkeypatch.setattr(kick, "SCENE", replace(kick.SCENE, simulate=fragile))
    command = ["simulate", "kick", "--out", str(tmp_path), "--count", "3", "--workers", "1"]
    assert main(command) == 1
    output = capsys.readouterr()
    assert "kick_00000 failed: unexpected ZeroDivisionError: no time at all (test_runner.py:" in output.out
    assert "1 sequence ended with an unexpected error" in output.err
    assert len(open_dataset(tmp_path).select("all")) == 2
    broken = False
    assert main(command) == 0
    assert len(open_dataset(tmp_path).select("all")) == 3


@pytest.mark.usefixtures("unchecked")
def test_output_that_is_not_a_motion_fails_with_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    nan = np.full((3, 4, 3), np.nan)
    defects = {
        "times: expected 0, 1, 2": {"times": np.array([0.0, 0.1, 0.1])},
        "times: expected (T,)": {"times": np.zeros(1), "vertices": np.zeros((1, 4, 3))},
        "vertices: expected shape": {"vertices": np.zeros((2, 4, 3))},
        "vertices: not finite in 3 of 3": {"vertices": nan},
        "faces: expected integers": {"faces": np.zeros((1, 4), int)},
        "faces: expected indices of 4 vertices, got 0 to 4": {"faces": np.array([[0, 1, 4]])},
        "weights: expected shape (4,)": {"weights": np.full(5, 0.2)},
        "weights: expected no negative": {"weights": np.full(4, 1.0)},
        "weights: expected no negative ones": {"weights": np.array([1.5, -0.5, 0.0, 0.0])},
    }
    left = list(defects.values())

    def faulty(parameters: Parameters, rate: float, step: float) -> SimpleNamespace:
        sound = {"times": np.arange(3) / rate, "vertices": np.zeros((3, 4, 3)), "faces": np.array([[0, 1, 2]])}
        return SimpleNamespace(**{**sound, "weights": np.full(4, 0.25), **left.pop(0)})

    monkeypatch.setattr(kick, "SCENE", replace(kick.SCENE, simulate=faulty))
    assert main(["simulate", "kick", "--out", str(tmp_path), "--count", str(len(defects)), "--workers", "1"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0] == f"0 sequences in {tmp_path}; failed: {len(defects)}"
    for entry, reason, line in zip(open_dataset(tmp_path).entries, defects, said[1:], strict=True):
        assert entry.status.startswith(reason)
        assert line == f"{entry.name} failed: {entry.status}"
    assert not list(tmp_path.glob("*.npz"))


def test_refuses_a_folder_with_another_data_set(dataset: Dataset) -> None:
    with pytest.raises(InputError, match="another data set"):
        simulate("kick", dataset.root, dataset.provenance["count"], seed=99)


def test_unknown_scene(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="kick"):
        simulate("throw", tmp_path, count=1)
