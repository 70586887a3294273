"""Recordings: started by a browser that closes, stopped by another one, and computed again."""

import subprocess
import sys
import tempfile

from odeform_figures.viewer_benchmark.client import DEADLINE
from odeform_figures.viewer_benchmark.visitors import Missed, Visitors

__all__ = ["record", "stop_recording"]


def record(visitors: Visitors) -> None:
    """Record a drag, then replay the file in a process of its own, which has to find the same frames."""
    path = visitors.folder / "visit.rrd"
    path.unlink(missing_ok=True)
    with visitors.another() as other:
        other.set("file", path.name)
        other.click("Start recording")
        visitors.expect_control("Stop recording")
        visitors.drag(other, 10)
    visitors.drag(visitors.second, 20)
    visitors.first.click("Play")
    visitors.collect(1.0)
    stop_recording(visitors)
    with tempfile.TemporaryFile("w+") as output:
        command = [sys.executable, "-m", "odeform_viz.start", "--replay", str(path)]
        with subprocess.Popen(command, stdout=output, stderr=output, text=True) as process:
            try:
                visitors.expect("the end of a replay", lambda: process.poll() is not None, 2.0 * DEADLINE)
            finally:
                process.kill()
        if process.returncode:
            output.seek(0)
            raise Missed(f"a replay ended with exit code {process.returncode}: {output.read()[-500:]}")
    path.unlink()


def stop_recording(visitors: Visitors) -> None:
    """Stop it, and wait for its end."""
    visitors.first.click("Stop recording")
    visitors.expect_control("Start recording")
    visitors.expect("the end of the recording", lambda: not visitors.app.recording.active)
