"""What users do wrong, and what machines do to them: one clear line, before the work starts, and nothing lost."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from odeform.dataset.importers.mesh_frames import mesh_source
from odeform.dataset.store import open_dataset
from odeform.errors import InputError, one_line
from odeform.io import atomic_write, require_writable
from odeform.training.train import train
from tests.commands import run

TIMES = ("--times", "0:0.02:0.01")


def _said(capsys: pytest.CaptureFixture[str]) -> str:
    error = capsys.readouterr().err.strip()
    assert "\n" not in error, error
    return error


@pytest.mark.parametrize(
    ("out", "more", "expected"),
    [
        ("a.npz", (), "errors against a truth are written to .csv only"),
        ("a.csv", ("--set", "mass=99"), "--set gives other parameters"),
        ("a.csv", ("--geometry", "volleyball"), "leave out --geometry"),
        ("a.csv", ("--truth", "kick/none"), "has no sequence 'none'"),
    ],
    ids=["format", "other parameters", "geometry", "no such sequence"],
)
def test_predict_refuses_a_truth_that_does_not_fit(
    out: str, more: tuple[str, ...], expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    truth = f"mass-elastic/{open_dataset('mass-elastic').select('test')[0].name}"
    assert run("predict", "mass-elastic/pod-rbf", "--truth", truth, "--out", tmp_path / out, *TIMES, *more) == 2
    assert expected in _said(capsys)
    assert not list(tmp_path.iterdir())


def test_predict_overwrites_nothing_without_force(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "motion.npz"
    out.write_text("precious")
    assert run("predict", "mass-elastic/pod-rbf", "--out", out, *TIMES) == 2
    assert "add --force" in _said(capsys)
    assert out.read_text() == "precious"
    assert run("predict", "mass-elastic/pod-rbf", "--out", out, "--force", *TIMES) == 0
    assert np.load(out)["vertices"].shape[0] == 2
    (tmp_path / "a_00001.ply").write_text("precious")
    assert run("predict", "mass-elastic/pod-rbf", "--out", tmp_path / "a_{frame}.ply", *TIMES) == 2
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a_00001.ply", "motion.npz"]


@pytest.mark.parametrize(("name", "why"), [("new/a.npz", "folder that exists"), ("folder.npz", "is a folder")])
def test_predict_refuses_a_place_that_cannot_be_written(
    name: str, why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("odeform.models.base.Predictor.solve", None)  # no work has started
    (tmp_path / "folder.npz").mkdir()
    assert run("predict", "mass-elastic/pod-rbf", "--out", tmp_path / name, "--force", *TIMES) == 2
    assert why in _said(capsys)
    assert not (tmp_path / "new").exists()


def test_train_refuses_a_place_that_cannot_be_written_before_it_starts(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    dataset = open_dataset("mass-elastic")
    with pytest.raises(InputError, match="cannot be written"):
        train(dataset, tmp_path / "file" / "a.safetensors", "nearest", report=lambda line: pytest.fail(line))
    require_writable(tmp_path / "new" / "folder" / "file")
    assert not (tmp_path / "new").exists()


def test_a_file_that_cannot_be_written_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    from odeform.cli import run_guarded

    assert run_guarded(lambda: atomic_write(Path("/proc/nowhere"), b"")) == 2
    assert "/proc/nowhere: " in _said(capsys)


def test_a_failed_write_names_its_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "chmod", full)
    with pytest.raises(OSError, match="No space left on device") as error:
        atomic_write(tmp_path / "file", b"data")
    assert error.value.filename == str(tmp_path / "file")
    assert not list(tmp_path.iterdir())


def test_long_arguments_are_not_echoed_whole(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("predict", "mass-elastic/pod-rbf", "--out", "a.npz", "--set", f"{'x' * 5000}=1") == 2
    assert len(_said(capsys)) < 1000
    with pytest.raises(SystemExit):
        run("evaluate", "kick", "--data", "kick", "--split", "x" * 5000)
    assert len(capsys.readouterr().err) < 2000
    assert one_line("a\nb\x1b[2J\tc") == "a b[2J c"


def test_a_negative_seed_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("import", tmp_path, "--out", tmp_path / "out", "--seed", "-1") == 2
    assert "seed of at least 0" in _said(capsys)


@pytest.mark.parametrize(
    ("table", "why"),
    [
        ("sequence,mass,split\na,1,train\nb,2,\n", "a split for every sequence or for none, got none for b"),
        ("sequence,mass,mass\na,1,2\nb,2,3\n", "two columns 'mass'"),
        ("sequence,mass (kg),mass (g)\na,1,2\nb,2,3\n", "two columns of the parameter 'mass'"),
    ],
)
def test_a_table_is_never_guessed_at(table: str, why: str, tmp_path: Path) -> None:
    for name in "ab":
        (tmp_path / name).mkdir()
    (tmp_path / "parameters.csv").write_text(table)
    with pytest.raises(InputError, match=why):
        mesh_source(tmp_path, rate=20.0)


@pytest.mark.slow
@pytest.mark.parametrize("module", ["odeform_viz.start", "odeform.cli"])
@pytest.mark.parametrize("delay", [0.15, 0.3, 0.6])
def test_an_early_interrupt_ends_the_command(module: str, delay: float) -> None:
    # a module that is being imported catches every exception, as trimesh does
    arguments = ["--port", "0"] if module == "odeform_viz.start" else ["stress", "kick"]
    # told when the interpreter is there, which takes seconds on a busy machine
    code = f"import runpy; print(flush=True); runpy.run_module({module!r}, run_name='__main__', alter_sys=True)"
    command = [sys.executable, "-c", code, *arguments]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        process.stdout.readline()
        time.sleep(delay)  # what is tested is the moment, on any machine
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=120.0)
    finally:
        process.kill()
    assert "Traceback" not in errors or delay < 0.3, errors
    assert process.returncode in (0, 130, -signal.SIGINT)


@pytest.mark.slow
def test_workers_end_with_the_process_that_started_them() -> None:
    code = "import time\nfrom odeform.parallel import as_completed\n"
    code += "for n, _ in as_completed(time.sleep, [0.0, 0.0, 300.0, 300.0], 2): print(n, flush=True)"
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        assert {process.stdout.readline(), process.stdout.readline()} == {"0\n", "1\n"}
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        workers = [Path(f"/proc/{pid}") for pid in children if "loky" in Path(f"/proc/{pid}/cmdline").read_text()]
        assert workers
    finally:
        process.kill()
        process.wait()
    deadline = time.monotonic() + 60.0
    while any(worker.exists() for worker in workers):
        assert time.monotonic() < deadline
        time.sleep(0.1)
    process.stdout.close()


@pytest.mark.slow
def test_a_worker_that_starts_after_the_end_of_its_parent_ends() -> None:
    code = "import os, time\nfrom odeform.parallel import _numbered\n_numbered(time.sleep, 0, 300.0, os.getppid() + 1)"
    assert subprocess.run([sys.executable, "-c", code], timeout=120).returncode == 1
