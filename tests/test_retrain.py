"""Bundled checkpoints are trained again from the bundled data."""

import json
from pathlib import Path

import pytest

from odeform.checkpoint import bundled_checkpoints
from odeform.cli import main
from odeform.cli.retrain import _command
from odeform.dataset.store import bundled_datasets
from odeform.io import bundled
from odeform.models.registry import load

RECORDED = bundled("results") / "retrained.json"


@pytest.mark.parametrize("name", bundled_checkpoints())
def test_every_checkpoint_records_how_it_was_trained_on_bundled_data(name: str, tmp_path: Path) -> None:
    arguments = _command(name, load(name).checkpoint.provenance, tmp_path / "again.safetensors", None)
    scene, model = name.split("/")
    assert arguments[0] == scene
    assert scene in bundled_datasets()
    assert ["--model", model] in [arguments[at : at + 2] for at in range(len(arguments))]


@pytest.mark.slow
def test_a_short_training_of_the_default_model_gives_the_recorded_scores(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded = json.loads(RECORDED.read_text())["kick --steps 2"]
    found = tmp_path / "found.json"
    assert main(["retrain", "kick", "--steps", "2", "--keep", str(tmp_path), "--json", str(found)]) == 0
    again = json.loads(found.read_text())["kick/odeform"]
    assert "--steps 2" in again["command"]
    # processors round differently, and training amplifies that
    assert again["again"] == pytest.approx(recorded, rel=0.1)
    assert "kick/odeform: " in capsys.readouterr().out


def test_others_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["retrain", "trick", "--keep", str(tmp_path)]) == 2
    assert "trick/odeform: expected bundled checkpoints" in capsys.readouterr().err
