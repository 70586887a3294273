"""Motions over several windows are compared with what the simulator says."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from odeform.dataset.store import open_dataset
from odeform.models.registry import load
from odeform.schema import Parameters
from odeform.simulation.scenes.kick import SCHEMA, simulate
from odeform.simulation.scenes.registry import get_scene
from odeform.types import MotionSequence
from odeform_figures.studies import later
from odeform_figures.studies.later import SPANS, compare_later, main, simulate_later


def test_a_ball_at_rest_stays_so_for_as_long_as_is_asked() -> None:
    dataset = open_dataset("mass-elastic")
    motions = simulate_later(dataset, 2)
    window = dataset.schema.window
    assert motions.times[-1] == pytest.approx(window.start + SPANS[-1][1] * (window.stop - window.start))
    assert all(len(vertices) == len(motions.times) for vertices in motions.vertices)
    found = compare_later(load("mass-elastic"), motions)
    assert found["motions"] == 2
    spans = found["windows"]
    assert all(0.0 < spans[f"{a:g}:{b:g}"]["median_mm"] < 1.0 for a, b in SPANS)
    # a model that is somewhere else is as wrong as that
    jump = np.where(motions.times > 0.0, 0.03, 0.0).astype(np.float32)[:, None, None]
    moved = replace(motions, vertices=[vertices + jump for vertices in motions.vertices])
    off = compare_later(load("mass-elastic"), moved)["windows"]["1:2"]
    assert off["pooled_mm"] > 25.0
    assert off["coverage_90"] < 0.5 < spans["1:2"]["coverage_90"]


def test_simulations_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    dataset, calls = open_dataset("kick"), []
    entry = dataset.select("test")[0]

    def simulated(parameters: Parameters, until: float) -> MotionSequence:
        calls.append(until)
        return dataset.read(entry)

    scene = replace(get_scene("kick"), simulate=simulated)
    monkeypatch.setattr(later, "get_scene", lambda _: scene)
    motions = [later._simulated("kick", 4.0, tmp_path / "kept", entry) for _ in range(2)]
    assert calls == [4.0]
    assert np.array_equal(*motions)


def test_the_command_writes_the_comparison(tmp_path: Path) -> None:
    out = tmp_path / "later.json"
    main(["mass-elastic/nearest", "--count", "1", "--json", str(out)])
    found = json.loads(out.read_text())
    assert found["command"] == "python -m odeform_figures.studies.later mass-elastic/nearest --count 1"
    assert set(found["models"]) == {"mass-elastic/nearest"}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["kick", "mass-elastic"], "one scene of one body, got those of kick, mass-elastic"),
        (["contact-force"], "one scene of one body, got those of contact-force"),
        (["trick"], "trick"),
        (["kick", "--count", "0"], "--count: expected at least 1, got 0"),
    ],
)
def test_what_cannot_be_compared_is_refused(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(arguments)
    assert said in capsys.readouterr().err


@pytest.mark.slow
def test_a_longer_simulation_begins_as_the_shorter_one() -> None:
    parameters = SCHEMA.complete({"azimuth": 0.3})
    short, long = (simulate(parameters, step=2e-3, resolution=5, until=until) for until in (0.1, 0.3))
    assert long.times[-1] == pytest.approx(0.3)
    assert np.array_equal(long.vertices[: len(short.times)], short.vertices)


def test_data_of_another_scene_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["mass-elastic/nearest", "--data", "kick"])
    assert "--data: expected a data set of scene mass-elastic, got one of kick" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["mass-elastic/nearest", "--data", "nowhere"])
    assert "nowhere" in capsys.readouterr().err
