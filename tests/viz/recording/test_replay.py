"""Replaying a recording finds every difference from what is computed now."""

import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import zstandard

import odeform
from odeform.checkpoint import bundled_checkpoints, write_checkpoint
from odeform.dataset.store import open_dataset
from odeform.geometry.shape import fit_to
from odeform.models.base import Predictor
from odeform.motion.recorded import RecordedMotion
from odeform.types import GaussianSplats, Mesh
from odeform_viz.cli import main
from odeform_viz.columns import Column, truth_column
from odeform_viz.recording import writer
from odeform_viz.recording.reader import read_recording
from odeform_viz.recording.replay import check_recording
from odeform_viz.view import Frame

Record = Callable[..., list[Frame]]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "session.rrd"


def _column(kick: Predictor, **more: object) -> Column:
    return replace(Column("odeform", kick, kick.rest, origin="kick"), **more)


def test_the_same_frames_agree(kick: Predictor, path: Path, record: Record, capsys: pytest.CaptureFixture[str]) -> None:
    record(path, [_column(kick)], np.linspace(0.0, 1.2, 12).tolist())
    (checked,) = check_recording(read_recording(path))
    assert checked.frames == 12
    assert 0.0 <= checked.error <= 2e-6
    assert main(["--replay", str(path)]) == 0
    assert "odeform: 12 frames" in capsys.readouterr().out


def test_columns_of_other_models_and_pinned_parameters_agree(kick: Predictor, path: Path, record: Record) -> None:
    rival, name = odeform.load("kick/pod-rbf"), "kick/pod-rbf"
    pinned = _column(kick, label="heavy one", pinned=kick.schema.complete({"mass": 0.9}))
    record(path, [_column(kick), Column("pod-rbf", rival, rival.rest, origin=name), pinned])
    checked = check_recording(read_recording(path))
    assert [(c.label, c.frames) for c in checked] == [("odeform", 3), ("pod-rbf", 3), ("heavy one", 3)]
    assert max(c.error for c in checked) <= 2e-6


def test_more_than_ten_columns_keep_their_names_and_parameters(kick: Predictor, path: Path, record: Record) -> None:
    masses = np.linspace(0.3, 1.0, 11)
    record(path, [_column(kick, label=f"{m:.2f}", pinned=kick.schema.complete({"mass": m})) for m in masses], [0.03])
    checked = check_recording(read_recording(path))
    assert sorted(c.label for c in checked) == [f"{m:.2f}" for m in masses]
    assert max(c.error for c in checked) <= 2e-6


def test_splats_are_checked_by_their_centres(kick: Predictor, path: Path, record: Record) -> None:
    points = 3.0 * kick.rest.points[::3]
    covariances = np.broadcast_to(1e-4 * np.eye(3), (len(points), 3, 3))
    ones = np.ones((len(points), 1, 3))
    fit = fit_to(GaussianSplats(points, covariances, ones, ones[:, 0, 0]), kick.rest)
    record(path, [_column(kick, geometry=fit.geometry, fit=fit)])
    (checked,) = check_recording(read_recording(path))
    assert checked.frames == 3
    assert checked.error <= 2e-6


@pytest.mark.parametrize("moved", ["vertex", "pose", "nan"])
def test_a_changed_vertex_or_pose_is_found(
    kick: Predictor, path: Path, record: Record, moved: str, capsys: pytest.CaptureFixture[str]
) -> None:
    def change(frame: Frame) -> Frame:
        (shown,) = frame.columns
        if frame.request.time != 0.02 or shown.points is None:
            return frame
        points, pose = shown.points.copy(), shown.pose.copy()
        if moved == "pose":
            pose[0, 3] += 3e-5
        else:
            points[7] += [3e-5, 0.0, 0.0] if moved == "vertex" else np.nan
        return replace(frame, columns=(replace(shown, points=points, pose=pose),))

    record(path, [_column(kick)], change=change)
    (checked,) = check_recording(read_recording(path))
    assert checked.frame == 1
    if moved != "nan":
        assert checked.error == pytest.approx(3e-5, abs=1e-6)
    if moved != "pose":
        assert checked.vertex == 7
    assert main(["--replay", str(path)]) == 1
    error = capsys.readouterr().err
    assert "differs by more than 1e-05 m" in error
    assert "Traceback" not in error
    assert main(["--replay", str(path), "--tolerance", "1e-4"]) == (moved == "nan")


def test_a_changed_or_missing_checkpoint_is_found(
    path: Path, tmp_path: Path, record: Record, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "model.safetensors"
    file.write_bytes(bundled_checkpoints()["kick/odeform"].read_bytes())
    model = odeform.load(file)
    record(path, [Column("mine", model, model.rest, origin=str(file))])
    assert main(["--replay", str(path)]) == 0
    write_checkpoint(file, replace(model.checkpoint, scores={}))
    assert main(["--replay", str(path)]) == 1
    assert "SHA-256" in capsys.readouterr().out
    file.unlink()
    assert main(["--replay", str(path)]) == 1
    assert "expected a file or one of the bundled" in capsys.readouterr().out


def test_a_truth_is_loaded_again_and_a_simulated_one_is_skipped(
    path: Path, tmp_path: Path, record: Record, capsys: pytest.CaptureFixture[str]
) -> None:
    name = open_dataset("mass-elastic").select("test")[0].name
    model, truth = odeform.load("mass-elastic"), truth_column(f"mass-elastic/{name}")
    assert truth.truth is not None
    own = Column("odeform", model, model.rest, origin="mass-elastic")
    record(path, [own, truth], [0.0, 0.31, 0.5], dict(truth.truth.parameters))
    checked = check_recording(read_recording(path))
    assert [(c.label, c.frames) for c in checked] == [("odeform", 3), ("truth", 3)]
    assert max(c.error for c in checked) <= 2e-6
    record(path, [own, replace(truth, origin="")], [0.31])
    assert main(["--replay", str(path)]) == 0
    assert "truth: skipped, it is not from a data set" in capsys.readouterr().out
    record(path, [replace(truth, origin="")], [0.31])
    assert main(["--replay", str(path)]) == 1
    assert "none of its columns" in capsys.readouterr().err
    other = replace(truth.truth.sequence, vertices=truth.truth.sequence.vertices + np.float32(1e-3))
    moved = RecordedMotion(truth.truth.schema, other)
    record(path, [replace(truth, source=moved, geometry=Mesh(other.vertices[0], other.faces))], [0.31])
    assert main(["--replay", str(path)]) == 1


KILLED = """
import os, signal, sys
import odeform
from odeform_viz.columns import Column, Columns
from odeform_viz.recording import writer
from odeform_viz.session import Session
from odeform_viz.view import ViewRequest
kick = odeform.load("kick")
session, columns = Session(kick.schema), Columns.of([Column("odeform", kick, kick.rest, origin="kick")]).all
recorder = writer.Recorder(sys.argv[1])
for frame in range(25):
    writer.FLUSH = 0.0 if frame < 20 else 1e9
    recorder.log(session.frame(ViewRequest(kick.schema.complete({}), 0.01 * frame, "balanced", columns)))
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.slow
def test_a_killed_process_leaves_what_was_flushed(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = [sys.executable, "-c", KILLED, str(path)]
    process = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120.0)
    assert process.returncode == -signal.SIGKILL, process.stderr
    recording = read_recording(path)
    assert recording.frames is None
    assert 20 <= len(recording.requests) <= 25
    assert main(["--replay", str(path)]) == 0
    printed = capsys.readouterr()
    assert "not closed" in printed.out
    assert not printed.err


@pytest.fixture
def old_recording(path: Path) -> Path:
    """Three frames of two columns, recorded by an older version, whose requests are an entity named `wish`."""
    packed = (Path(__file__).parent / "session-0.1.rrd.zst").read_bytes()
    path.write_bytes(zstandard.ZstdDecompressor().decompress(packed, max_output_size=1 << 20))
    return path


def test_an_older_recording_is_read_and_compared(old_recording: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording = read_recording(old_recording)
    assert [request["time"] for request in recording.requests.values()] == [0.0, 0.02, 0.5]
    assert [facts["label"] for _, facts in sorted(recording.columns.items())] == ["odeform", "heavy"]
    # of a model that was bundled then, and is another now
    assert main(["--replay", str(old_recording)]) == 1
    assert "the result differs by more than 1e-05 m: odeform, heavy" in capsys.readouterr().err


def test_missing_points_are_an_error_only_in_a_closed_recording(kick: Predictor, path: Path, record: Record) -> None:
    record(path, [_column(kick)])
    recording = read_recording(path)
    recording.requests[2] = {**recording.requests[2], "columns": {"column_0/form_0": 99}}
    (checked,) = check_recording(recording)
    assert (checked.frames, checked.missing) == (2, 1)
    assert not checked.agrees(1e-5, closed=True)
    assert checked.agrees(1e-5, closed=False)


def test_a_recording_of_another_format_is_refused(
    kick: Predictor, path: Path, record: Record, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(writer, "FORMAT", 3)
    record(path, [_column(kick)], [0.0])
    assert main(["--replay", str(path)]) == 2
    assert "expected format 1 or 2, got format 3" in capsys.readouterr().err


@pytest.mark.parametrize("damage", ["missing", "folder", "text", "empty", "truncated", "start", "foreign"])
def test_another_or_damaged_file_is_refused_in_one_line(
    kick: Predictor, path: Path, record: Record, damage: str, capfd: pytest.CaptureFixture[str]
) -> None:
    import rerun as rr

    record(path, [_column(kick)], [0.02])
    data = path.read_bytes()
    path.unlink()
    if damage == "folder":
        path.mkdir()
    elif damage == "foreign":
        stream = rr.RecordingStream("another")
        stream.save(str(path))
        stream.log("request", rr.Scalars(1.0))
        stream.disconnect()
    elif damage != "missing":
        content = {"text": b"hello" * 99, "empty": b"", "truncated": data[: len(data) // 2], "start": data[:40]}
        path.write_bytes(content[damage])
    assert main(["--replay", str(path)]) == 2
    error = capfd.readouterr().err.strip()
    assert error.startswith(f"error: recording {path}")
    assert "\n" not in error


@pytest.mark.parametrize("tolerance", ["0", "-1", "nan"])
def test_the_tolerance_is_positive(tolerance: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--replay", "any.rrd", "--tolerance", tolerance]) == 2
    assert "--tolerance" in capsys.readouterr().err


def test_a_shape_that_was_not_trained_is_recorded_and_replayed_as_such(
    kick: Predictor, path: Path, record: Record, capsys: pytest.CaptureFixture[str]
) -> None:
    box = Mesh(kick.rest.points * np.float32([1.0, 1.0, 0.6]), kick.rest.faces)
    sinking = {"mass": 0.99, "bending": 0.3, "force": 115.0, "azimuth": 0.0, "elevation": 0.5}
    record(path, [_column(kick, geometry=box), _column(kick, label="ball")], [0.0, 3.5], sinking)
    recording = read_recording(path)
    flat, ball = (facts for _, facts in sorted(recording.columns.items()))
    assert flat["likeness"]["trained"] is False
    assert flat["likeness"]["distance"] > 0.03
    assert flat["scores"] == {}
    assert ball["likeness"]["trained"] is True
    assert ball["scores"]["rmse_pooled_mm"] > 0.0
    assert main(["--replay", str(path)]) == 0
    first, second = capsys.readouterr().out.splitlines()[1:3]
    assert "this shape was not trained" in first
    assert "not trained" not in second
