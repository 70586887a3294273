"""Work on a real Dask scheduler and two worker processes on loopback."""

import hashlib
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from odeform.cli import main
from odeform.cluster import on_cluster
from odeform.errors import InputError
from odeform.parallel import as_completed
from odeform.simulation.runner import simulate
from odeform.stress.shown import check_shown
from odeform_figures.tables.runs import Run, complete_runs

pytest.importorskip("distributed")
pytestmark = pytest.mark.slow


def dask(*command: str) -> subprocess.Popen[str]:
    here = (
        f"{Path(__file__).parent}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"  # workers call functions of this file
    )
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": here}
    return subprocess.Popen(
        [sys.executable, "-m", "dask", *command, "--no-dashboard"],
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    )


def ended(process: subprocess.Popen[str]) -> None:
    process.send_signal(signal.SIGINT)
    try:
        process.wait(timeout=120.0)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def said(process: subprocess.Popen[str], pattern: str, count: int = 1) -> str:
    """The group of `pattern` in the `count`-th line with it; all later lines are read, too, so that none blocks."""
    assert process.stderr is not None
    for line in process.stderr:
        if found := re.search(pattern, line):
            count -= 1
            if not count:
                threading.Thread(target=process.stderr.read, daemon=True).start()
                return found[1]
    raise AssertionError(f"{process.args}: ended without {pattern}")


@contextmanager
def scheduler() -> Iterator[str]:
    process = dask("scheduler", "--host", "127.0.0.1", "--port", "0")
    try:
        yield said(process, r"Scheduler at:\s+(tcp://\S+)")
    finally:
        ended(process)


@contextmanager
def workers(address: str, count: int = 1, *options: str) -> Iterator[None]:
    """`count` worker processes, each restarted by its parent when it is killed."""
    process = dask("worker", address, "--nworkers", str(count), "--nthreads", "1", *options)
    try:
        said(process, r"Starting established connection to (\S+)", count)
        yield
    finally:
        ended(process)


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    with scheduler() as address, workers(address, 2):
        yield address


def process_of(_: int) -> int:
    time.sleep(0.2)
    return os.getpid()


def end_process_once(flag: str) -> str:
    """Ends its process the first time that it is called with this file, as an operating system short of memory."""
    if not Path(flag).exists():
        Path(flag).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return Path(flag).name


def end_process(index: int) -> int:
    if index == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return index


def test_work_is_done_by_the_workers(cluster: str) -> None:
    with on_cluster(cluster):
        found = {process for _, process in as_completed(process_of, range(6))}
    assert len(found) == 2
    assert os.getpid() not in found


def test_the_same_data_as_on_one_machine(cluster: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with on_cluster(cluster):
        simulate("kick", tmp_path / "there", count=3, rate=30.0, step=4e-3)
    assert "simulate kick: 3/3" in capsys.readouterr().err
    simulate("kick", tmp_path / "here", count=3, rate=30.0, step=4e-3)
    there, here = (
        {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in (tmp_path / side).iterdir()}
        for side in ("there", "here")
    )
    assert len(there) == 4
    assert there == here


def test_a_killed_worker_loses_nothing(cluster: str, tmp_path: Path) -> None:
    flags = [str(tmp_path / str(index)) for index in range(4)]
    for flag in flags[:3]:
        Path(flag).touch()
    with on_cluster(cluster):
        assert dict(as_completed(end_process_once, flags)) == {index: str(index) for index in range(4)}
    assert Path(flags[3]).exists(), "its process was ended"


def test_work_that_ends_every_worker_is_an_error(cluster: str) -> None:
    """Not a result that is silently missing, nor one that is awaited forever."""
    with on_cluster(cluster), pytest.raises(ChildProcessError, match="KilledWorker"):
        list(as_completed(end_process, range(3)))


def test_one_worker_does_the_work_and_later_ones_help(tmp_path: Path) -> None:
    with scheduler() as address, workers(address, 1), on_cluster(address):
        found = as_completed(process_of, range(40))
        first = next(found)[1]
        assert first != os.getpid()
        with workers(address, 1):
            assert len({first, *(process for _, process in found)}) == 2


def test_a_lost_scheduler_is_an_error() -> None:
    process = dask("scheduler", "--host", "127.0.0.1", "--port", "0")
    try:
        address = said(process, r"Scheduler at:\s+(tcp://\S+)")
        with workers(address, 1), on_cluster(address):
            found = as_completed(process_of, range(40))
            next(found)
            process.kill()
            with pytest.raises(ChildProcessError, match="connection"):
                list(found)
    finally:
        ended(process)


def test_runs_of_the_tables(cluster: str, tmp_path: Path) -> None:
    runs = [Run("nearest", "mass-elastic", ((0, 20),)), Run("pod-rbf", "mass-elastic", ((0, 20),), until=40)]
    with on_cluster(cluster, shared=tmp_path):
        found = complete_runs(runs, tmp_path, jobs=1)
    for run in runs:
        assert json.loads((tmp_path / f"{run.name}.json").read_text()) == found[run]
    assert len(list(tmp_path.glob("*.safetensors"))) == 2


def test_stress_has_the_same_outcomes(cluster: str) -> None:
    with on_cluster(cluster):
        there = check_shown("mass-elastic/pod-rbf", 40)
    assert there == check_shown("mass-elastic/pod-rbf", 40)


@pytest.mark.parametrize(
    ("command", "address"),
    [
        ("simulate kick --out kicks", "tcp://127.0.0.1:9"),
        ("stress", "nowhere"),
        ("tables --keep runs --out tables.md", "tcp://127.0.0.1:port"),
    ],
)
def test_a_wrong_address_is_one_line(
    command: str, address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([*command.split(), "--cluster", address]) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: --cluster: no Dask scheduler at")
    assert error.count("\n") == 1
    assert not (tmp_path / "kicks").exists()


def test_refuses_workers_that_would_compute_something_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("odeform.cluster.PATIENCE", 5.0)
    with scheduler() as address:
        with pytest.raises(InputError, match="has no workers"), on_cluster(address):
            pass
        with workers(address, 1):
            monkeypatch.setattr("odeform.cluster.COMPARED", ("odeform",))
            with pytest.raises(InputError, match=r"expected , got numpy"), on_cluster(address):
                pass
