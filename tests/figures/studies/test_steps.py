"""Halving a step twice, on motions that are known."""

import json
from pathlib import Path

import numpy as np
import pytest

from odeform.schema import Parameters
from odeform.simulation.errors import SimulationError
from odeform.types import MotionSequence
from odeform_figures.studies import steps as module
from odeform_figures.studies.steps import main, steps


def second_order(parameters: Parameters, step: float) -> MotionSequence:
    """Two vertices that move by 10 mm, and by 1 mm more for a step of 0.5 ms, falling with its square."""
    if parameters["object"] == "dog":
        raise SimulationError("it turns inside out")
    vertices = np.zeros((2, 2, 3))
    vertices[1, :, 0] = 0.01 + 1e-3 * (step / 5e-4) ** 2
    return MotionSequence(np.array([0.0, 0.1]), vertices.astype(np.float32), np.zeros((0, 3), int), np.full(2, 0.5))


@pytest.fixture(autouse=True)
def known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "simulate", second_order)


def test_changes_are_relative_to_the_displacement() -> None:
    found = steps(["cat", "dog"], count=3, seed=0, workers=1)
    assert found["steps_ms"] == [0.5, 0.25, 0.125]
    cat, dog = found["objects"]["cat"], found["objects"]["dog"]
    displacement = 10.0625 / np.sqrt(2.0)  # of two frames, of which one is at rest
    assert cat["displacement_mm"] == pytest.approx(displacement, rel=1e-4)
    assert cat["halved"] == pytest.approx([0.75 / 10.0625, 0.1875 / 10.0625], rel=1e-3)
    assert dog == {"failed": 3}
    assert found["pushes"][3]["failed"] == "it turns inside out"


def test_the_first_pushes_can_be_left_out(tmp_path: Path) -> None:
    whole = steps(["cat"], count=3, seed=0, workers=1)
    main(["cat", "--count", "3", "--skip", "2", "--workers", "1", "--json", str(tmp_path / "steps.json")])
    last = json.loads((tmp_path / "steps.json").read_text())
    assert [push["parameters"] for push in last["pushes"]] == [whole["pushes"][2]["parameters"]]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(["tiger"], "tiger: expected objects"), (["--count", "0"], "at least 1"), (["--skip", "6"], "less than --count")],
)
def test_commands_that_cannot_be_run(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(arguments)
    assert message in capsys.readouterr().err
