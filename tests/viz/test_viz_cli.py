"""The `odeform-viz` command as a user runs it."""

import signal
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest
import rerun as rr
import trimesh

from odeform_viz.cli import main


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--checkpoint", "nowhere.safetensors"], "nowhere"),
        (["--compare", "kick/none"], "kick/none"),
        (["--geometry", "missing.ply"], "missing.ply"),
        (["--device", "cuda"], "cpu"),
        (["--port", "70000"], "70000"),
        (["--record", "/proc/nowhere/session.rrd"], "session.rrd"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    error = capsys.readouterr().err.strip()
    assert said in error
    assert "\n" not in error


def test_broken_shapes_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mesh = trimesh.creation.icosphere(1)
    mesh.vertices[3] = float("nan")
    path = tmp_path / "broken.obj"
    path.write_bytes(str(trimesh.exchange.obj.export_obj(mesh)).encode())
    assert main(["--geometry", str(path)]) == 2
    assert "not finite" in capsys.readouterr().err


def test_serves_the_bundled_model_and_completes_its_recording(tmp_path: Path) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    record = tmp_path / "session.rrd"
    command = [sys.executable, "-m", "odeform_viz.cli", "--port", str(port), "--record", str(record)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert f"http://127.0.0.1:{port}" in line
        with urllib.request.urlopen(f"http://127.0.0.1:{port}", timeout=10) as page:
            assert page.status == 200
        time.sleep(2.0)
    finally:
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=30)
    assert process.returncode == 0, errors
    assert "Traceback" not in errors
    entities = {chunk.entity_path for chunk in rr.chunk.RrdReader(str(record)).stream().to_chunks()}
    assert any("body" in entity for entity in entities)
    assert "/parameters/mass" in entities
