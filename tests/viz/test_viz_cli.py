"""The `odeform-viz` command as a user runs it."""

import re
import signal
import subprocess
import sys
import threading
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import trimesh

from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.cli import main
from odeform_viz.recording.reader import read_recording

DEADLINE = 120.0  # s, for a busy machine


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--checkpoint", "nowhere.safetensors"], "nowhere"),
        (["--compare", "kick/none"], "kick/none"),
        (["--geometry", "missing.ply"], "missing.ply"),
        (["--sequence", "mass-elastic/none"], "mass-elastic/none"),
        (["--device", "cuda"], "expected cpu, got cuda"),
        (["--port", "70000"], "70000"),
        (["--host", "0.0.0.0"], "add --expose"),
        (["--allow-origin", "*"], "--allow-origin"),
        (["--record", "/proc/nowhere/session.rrd"], "session.rrd"),
    ],
)
def test_invalid_input_is_one_line_and_exit_code_2(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    error = capsys.readouterr().err.strip()
    assert message in error
    assert "\n" not in error


def test_broken_shapes_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mesh = trimesh.creation.icosphere(1)
    mesh.vertices[3] = float("nan")
    path = tmp_path / "broken.obj"
    path.write_bytes(str(trimesh.exchange.obj.export_obj(mesh)).encode())
    assert main(["--geometry", str(path)]) == 2
    assert "not finite" in capsys.readouterr().err


@pytest.mark.parametrize(("option", "printed"), [("--version", r"odeform-viz \d+\.\d+\.\d+"), ("--help", "--record")])
def test_version_and_help_are_printed(option: str, printed: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as exit_:
        main([option])
    assert exit_.value.code == 0
    assert re.search(printed, capsys.readouterr().out)


@contextmanager
def _viewer(*arguments: str) -> Iterator[tuple["subprocess.Popen[str]", int]]:
    """`odeform-viz` in a process of its own, and its port. The process ends with the block, or at the deadline."""
    command = [sys.executable, "-X", "faulthandler", "-m", "odeform_viz.cli", "--port", "0", *arguments]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    watchdog = threading.Timer(DEADLINE, process.send_signal, (signal.SIGABRT,))  # it says where all threads are
    watchdog.start()
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        address = re.search(r"http://127\.0\.0\.1:(\d+)", line)
        assert address is not None, line or process.communicate()[1]
        yield process, int(address[1])
    finally:
        watchdog.cancel()
        process.kill()
        process.communicate()


@pytest.mark.slow
def test_serves_the_bundled_model_and_completes_its_recording(tmp_path: Path) -> None:
    record = tmp_path / "session.rrd"
    with _viewer("--record", str(record)) as (process, port):
        with urllib.request.urlopen(f"http://127.0.0.1:{port}", timeout=DEADLINE) as page:
            assert page.status == 200
        with LoopbackClient(port) as client:
            assert client.until(lambda: "/world/column_0/body/part_0" in client.nodes, DEADLINE)
            assert client.until(lambda: record.stat().st_size > 100_000, DEADLINE)  # frames, and not the header alone
        process.send_signal(signal.SIGINT)
        printed, errors = process.communicate(timeout=DEADLINE)
        assert process.returncode == 0, errors
    assert printed.strip() == "stopped"
    assert "Traceback" not in errors
    recording = read_recording(record)
    assert recording.frames == len(recording.requests) > 0
    assert "mass" in recording.requests[0]["parameters"]
    assert next(iter(recording.points()))[0] == "column_0/form_0"
