"""What a start imports: predicting loads neither the training framework nor GUI, recorder or simulator."""

import subprocess
import sys
from pathlib import Path

import pytest

HEAVY = ("torch", "viser", "rerun", "mujoco", "joblib", "odeform_viz")
LIBRARIES = ("numpy", "scipy", "trimesh", "safetensors", *HEAVY)


def run(script: str, folder: Path) -> None:
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=folder, check=False)
    assert done.returncode == 0, done.stderr


def test_a_bare_import_loads_no_library(tmp_path: Path) -> None:
    """Nor does the help of the command; names are imported when they are first used."""
    script = f"""
import sys
import odeform
from odeform.cli import main
assert "simulate" in dir(odeform)
try:
    main(["--help"])
except SystemExit as end:
    assert end.code == 0
found = [name for name in {LIBRARIES!r} if name in sys.modules]
assert not found, found
"""
    run(script, tmp_path)


@pytest.mark.parametrize("model", ["odeform", "pod-rbf", "nearest"])
def test_predicting_loads_nothing_heavy(trained: dict[str, Path], model: str, tmp_path: Path) -> None:
    script = f"""
import sys
import odeform
motion = odeform.load({str(trained[model])!r}).solve(parameters={{"mass": 0.6}})
assert motion.vertices(0.5).shape == motion.geometry.points.shape
from odeform.cli import main
assert main(["predict", {str(trained[model])!r}, "--out", {str(tmp_path / "a.npz")!r}, "--times", "0:0.1:0.05"]) == 0
assert main(["info", {str(trained[model])!r}]) == 0
found = [name for name in {HEAVY!r} if name in sys.modules]
assert not found, found
"""
    run(script, tmp_path)
