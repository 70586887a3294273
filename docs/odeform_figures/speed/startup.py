"""Start-up time of a new process."""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

__all__ = ["startup"]

REPEATS = 3


def startup(checkpoint: str) -> dict[str, float]:
    """Seconds from the start of a process to the end of `import odeform`, and of `odeform predict` with one frame.

    The best of a few, so that files are in the page cache.
    """
    with tempfile.TemporaryDirectory(prefix="odeform-") as folder:
        predict = [checkpoint, "--times", "0:0.001:0.001", "--force", "--out", str(Path(folder) / "frame.npz")]
        commands = {"import_s": ["-c", "import odeform"], "predict_s": ["-m", "odeform.cli", "predict", *predict]}
        return {
            name: min(_seconds([sys.executable, *arguments]) for _ in range(REPEATS))
            for name, arguments in commands.items()
        }


def _seconds(command: list[str]) -> float:
    begin = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - begin
