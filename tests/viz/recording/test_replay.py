"""A recording is computed again; what is not what it was is found."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import odeform
from odeform.checkpoint import bundled_checkpoints, write_checkpoint
from odeform.dataset.store import open_dataset
from odeform.geometry.shape import fit_to
from odeform.models.base import Predictor
from odeform.motion.recorded import RecordedMotion
from odeform.types import GaussianSplats, Mesh
from odeform_viz.cli import main
from odeform_viz.columns import Column, truth_column
from odeform_viz.recording.reader import read_recording
from odeform_viz.recording.replay import check_recording
from odeform_viz.view import Frame

Record = Callable[..., list[Frame]]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "session.rrd"


def _column(kick: Predictor, **more: object) -> Column:
    return replace(Column("odeform", kick, kick.rest, origin="kick"), **more)


def test_the_same_comes_out_again(
    kick: Predictor, path: Path, record: Record, capsys: pytest.CaptureFixture[str]
) -> None:
    record(path, [_column(kick)], np.linspace(0.0, 1.2, 12).tolist())
    (checked,) = check_recording(read_recording(path))
    assert checked.frames == 12
    assert 0.0 <= checked.off <= 2e-6
    assert main(["--replay", str(path)]) == 0
    assert "odeform: 12 frames" in capsys.readouterr().out


def test_models_compared_and_pinned_ones(kick: Predictor, path: Path, record: Record) -> None:
    rival, name = odeform.load("kick/pod-rbf"), "kick/pod-rbf"
    pinned = _column(kick, label="heavy one", pinned=kick.schema.complete({"mass": 0.9}))
    record(path, [_column(kick), Column("pod-rbf", rival, rival.rest, origin=name), pinned])
    checked = check_recording(read_recording(path))
    assert [(c.label, c.frames) for c in checked] == [("odeform", 3), ("pod-rbf", 3), ("heavy one", 3)]
    assert max(c.off for c in checked) <= 2e-6


def test_more_than_ten_columns_keep_their_names_and_parameters(kick: Predictor, path: Path, record: Record) -> None:
    masses = np.linspace(0.3, 1.0, 11)
    record(path, [_column(kick, label=f"{m:.2f}", pinned=kick.schema.complete({"mass": m})) for m in masses], [0.03])
    checked = check_recording(read_recording(path))
    assert sorted(c.label for c in checked) == [f"{m:.2f}" for m in masses]
    assert max(c.off for c in checked) <= 2e-6


def test_splats_are_checked_by_their_centres(kick: Predictor, path: Path, record: Record) -> None:
    points = 3.0 * kick.rest.points[::3]
    covariances = np.broadcast_to(1e-4 * np.eye(3), (len(points), 3, 3))
    ones = np.ones((len(points), 1, 3))
    fit = fit_to(GaussianSplats(points, covariances, ones, ones[:, 0, 0]), kick.rest)
    record(path, [_column(kick, geometry=fit.geometry, fit=fit)])
    (checked,) = check_recording(read_recording(path))
    assert checked.frames == 3
    assert checked.off <= 2e-6


@pytest.mark.parametrize("moved", ["vertex", "pose", "nan"])
def test_a_change_of_what_was_shown_is_found(
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
        assert checked.off == pytest.approx(3e-5, abs=1e-6)
    if moved != "pose":
        assert checked.vertex == 7
    assert main(["--replay", str(path)]) == 1
    error = capsys.readouterr().err
    assert "not what comes out now" in error
    assert "Traceback" not in error
    assert main(["--replay", str(path), "--tolerance", "1e-4"]) == (moved == "nan")


def test_another_checkpoint_of_that_name_is_found(
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
    assert "neither a file" in capsys.readouterr().out


def test_truth_is_read_again_and_what_was_simulated_is_skipped(
    path: Path, tmp_path: Path, record: Record, capsys: pytest.CaptureFixture[str]
) -> None:
    name = open_dataset("mass-elastic").select("test")[0].name
    model, truth = odeform.load("mass-elastic"), truth_column(f"mass-elastic/{name}")
    assert truth.truth is not None
    own = Column("odeform", model, model.rest, origin="mass-elastic")
    record(path, [own, truth], [0.0, 0.31, 0.5], dict(truth.truth.parameters))
    checked = check_recording(read_recording(path))
    assert [(c.label, c.frames) for c in checked] == [("odeform", 3), ("truth", 3)]
    assert max(c.off for c in checked) <= 2e-6
    record(path, [own, replace(truth, origin="")], [0.31])
    assert main(["--replay", str(path)]) == 0
    assert "truth: skipped, simulated on the spot" in capsys.readouterr().out
    record(path, [replace(truth, origin="")], [0.31])
    assert main(["--replay", str(path)]) == 1
    assert "nothing in it" in capsys.readouterr().err
    other = replace(truth.truth.sequence, vertices=truth.truth.sequence.vertices + np.float32(1e-3))
    moved = RecordedMotion(truth.truth.schema, other)
    record(path, [replace(truth, source=moved, geometry=Mesh(other.vertices[0], other.faces))], [0.31])
    assert main(["--replay", str(path)]) == 1


KILLED = """
import os, signal, sys, time
import odeform
from odeform_viz.columns import Column, Columns
from odeform_viz.recording.writer import Recorder
from odeform_viz.session import Session
from odeform_viz.view import ViewRequest
kick = odeform.load("kick")
session, columns = Session(kick.schema), Columns.of([Column("odeform", kick, kick.rest, origin="kick")]).all
recorder = Recorder(sys.argv[1])
begin = time.monotonic()
while time.monotonic() - begin < 2.5:
    recorder.log(session.frame(ViewRequest(kick.schema.complete({}), 0.01 * recorder.frames, "balanced", columns)))
    time.sleep(0.02)
print(recorder.frames, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_killed_process_leaves_what_was_flushed(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    process = subprocess.run([sys.executable, "-c", KILLED, str(path)], capture_output=True, text=True, check=False)
    assert process.returncode < 0, process.stderr
    recording = read_recording(path)
    assert recording.frames is None
    assert 0.3 * int(process.stdout) < len(recording.requests) <= int(process.stdout)
    assert main(["--replay", str(path)]) == 0
    said = capsys.readouterr()
    assert "not ended" in said.out
    assert not said.err


def test_frames_without_their_points_are_wrong_only_where_it_ended(kick: Predictor, path: Path, record: Record) -> None:
    record(path, [_column(kick)])
    recording = read_recording(path)
    recording.requests[2] = {**recording.requests[2], "columns": {"column_0/form_0": 99}}
    (checked,) = check_recording(recording)
    assert (checked.frames, checked.missing) == (2, 1)
    assert not checked.agrees(1e-5, ended=True)
    assert checked.agrees(1e-5, ended=False)


def test_a_recording_of_another_format_is_refused(
    kick: Predictor, path: Path, record: Record, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("odeform_viz.recording.writer.FORMAT", 2)
    record(path, [_column(kick)], [0.0])
    assert main(["--replay", str(path)]) == 2
    assert "expected format 1, got 2" in capsys.readouterr().err


@pytest.mark.parametrize("damage", ["missing", "folder", "text", "empty", "truncated", "start", "foreign"])
def test_what_is_no_recording_is_one_line(
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
def test_a_tolerance_is_a_length(tolerance: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--replay", "any.rrd", "--tolerance", tolerance]) == 2
    assert "--tolerance" in capsys.readouterr().err
