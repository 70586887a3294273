"""The command that measures start-up times and what fewer modes would save."""

import json
from pathlib import Path

import pytest

from odeform_figures.speed import ablations, startup
from odeform_figures.speed.__main__ import main


@pytest.mark.slow
def test_a_reduced_model_is_measured(trained: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ablations, "POINTS", 400)
    monkeypatch.setattr(startup, "REPEATS", 1)
    out = tmp_path / "speed.json"
    assert main([str(trained["odeform"]), "--json", str(out)]) == 0
    result = json.loads(out.read_text())
    assert all(result["startup"][key] > 0.0 for key in ("import_s", "predict_s"))
    rows = {row["ablation"]: row["error_mm"] for row in result["ablations"]}
    assert rows["no deformation: one pose per frame"] > rows["float16 vertices: half the bytes"] > 0.0


def test_a_model_of_points_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["mass-elastic/direct"]) == 2
    assert "direct: expected a model of reduced coordinates" in capsys.readouterr().err
