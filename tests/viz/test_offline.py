"""Nothing phones home: no command opens a connection beyond this machine."""

import subprocess
import sys
from pathlib import Path

import pytest

CODE = """
import socket, sys

def check(event, arguments):
    if event == "socket.getaddrinfo" and arguments[0] not in (None, "127.0.0.1", "localhost"):
        raise SystemExit(f"{event} {arguments}")
    if event in ("socket.connect", "socket.sendto") and isinstance(arguments[1], tuple):
        if arguments[1][0] not in ("127.0.0.1", "::1"):
            raise SystemExit(f"{event} {arguments[1]}")

sys.addaudithook(check)
"""
COMMANDS = {
    "predict": "from odeform.cli import main; code = main(['predict', 'mass-elastic/pod-rbf', '--out', 'a.npz'])",
    "import": "from odeform.cli import main; code = main(['import', 'nowhere', '--out', 'out']) - 2",
    "viewer and recording": """
import odeform, pathlib, threading
from odeform_viz.app import App
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.columns import Column
model = odeform.load("mass-elastic/pod-rbf")
app = App([Column("pod-rbf", model, model.rest, origin="mass-elastic/pod-rbf")], port=0, record="a.rrd")
with LoopbackClient(app.server.get_port()) as client:
    file = pathlib.Path("a.rrd")
    code = 0 if client.until(lambda: app.presenter.frame is not None and file.stat().st_size > 100_000) else 3
app.close()
""",
}


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_no_connection_leaves_this_machine(command: str, tmp_path: Path) -> None:
    code = f"{CODE}\n{COMMANDS[command]}\nsys.exit(code)"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=240.0)
    assert done.returncode == 0, done.stderr
    if sys.platform == "linux" and command == "viewer and recording":
        _run_without_a_network(code, tmp_path / "again")


def _run_without_a_network(code: str, folder: Path) -> None:
    """Native code escapes Python's audit: the same works, and as fast, where there is no network but loopback."""
    folder.mkdir()
    isolated = ["unshare", "--user", "--map-root-user", "--net", "sh", "-c", 'ip link set lo up && exec "$0" -c "$1"']
    if subprocess.run([*isolated, sys.executable, "pass"], capture_output=True).returncode:
        pytest.skip("no network namespaces here")
    done = subprocess.run([*isolated, sys.executable, code], cwd=folder, capture_output=True, text=True, timeout=240.0)
    assert done.returncode == 0, done.stderr
