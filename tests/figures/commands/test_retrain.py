"""Bundled checkpoints are trained again from the bundled data."""

import json
from pathlib import Path

import numpy as np
import pytest

from odeform.checkpoint import bundled_checkpoints
from odeform.cli import main
from odeform.dataset.store import bundled_datasets
from odeform.io import bundled
from odeform.models.names import ALIASES
from odeform.models.registry import load
from odeform_figures.commands.retrain import _command

RECORDED = bundled("results") / "retrained.json"


@pytest.mark.parametrize("name", bundled_checkpoints())
def test_every_checkpoint_records_how_it_was_trained_on_bundled_data(name: str, tmp_path: Path) -> None:
    arguments = _command(name, load(name).checkpoint.provenance, tmp_path / "again.safetensors", None)
    scene, model = name.split("/")
    assert arguments[0] == scene
    assert scene in bundled_datasets()
    families = {"kick": "rolling", "contact-force": "modal"}
    expected = families.get(scene, "latent") if model == "odeform" else ALIASES.get(model, model)
    assert load(name).model == expected
    named = arguments[arguments.index("--model") + 1]
    assert named == "odeform" or ALIASES.get(named, named) == expected


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


@pytest.mark.slow
def test_a_continuation_alone_is_fitted_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name, out = "mass-elastic/pod-rbf", tmp_path / "mass-elastic_pod-rbf.safetensors"
    assert main(["retrain", name, "--only", "continuation", "--keep", str(tmp_path)]) == 0
    assert "(+0.00 %)" in capsys.readouterr().out
    again, recorded = load(out).checkpoint, load(name).checkpoint
    assert again.scores == recorded.scores
    assert again.provenance["command"] == recorded.provenance["command"]
    assert again.provenance["continuation"]["command"] == f"odeform retrain {name} --only continuation"
    assert np.array_equal(load(out).solve().vertices(0.7), load(name).solve().vertices(0.7))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["mass-elastic/direct"], "direct: expected a model of reduced coordinates"),
        (["contact-force"], "of one body, which is continued"),
        (["kick", "--steps", "5"], "--steps: only training takes steps"),
    ],
)
def test_what_is_not_continued_is_refused(
    arguments: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["retrain", *arguments, "--only", "continuation", "--keep", str(tmp_path)]) == 2
    assert said in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_only_solver_settings_of_pushed_objects_are_measured_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["retrain", "kick", "--only", "qualities", "--keep", str(tmp_path)]) == 2
    assert "rolling: expected a mechanical model" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_others_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["retrain", "trick", "--keep", str(tmp_path)]) == 2
    assert "trick/odeform: expected bundled checkpoints" in capsys.readouterr().err
