"""What a program passes by mistake is refused in words, and what is wrong in a class of its own is shown as it is."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import odeform
from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.models.baselines.nearest import Nearest
from odeform.models.registry import open_checkpoint
from odeform.motion.base import Motion

pytestmark = pytest.mark.usefixtures("unchecked")  # annotations would refuse some of it first


@pytest.fixture(scope="module")
def nearest() -> Predictor:
    return odeform.load("mass-elastic/nearest")


@pytest.fixture(scope="module")
def motion(nearest: Predictor) -> Motion:
    return nearest.solve()


@pytest.mark.parametrize("quality", ["no such quality", None, ["draft"]])
def test_a_baseline_knows_the_names_of_qualities_too(nearest: Predictor, quality: Any) -> None:
    with pytest.raises(InputError, match=r"unknown quality .*: expected one of draft, balanced, reference"):
        nearest.solve(quality=quality)


@pytest.mark.parametrize("until", [float("nan"), "soon"])
def test_an_end_is_a_number_of_seconds(nearest: Predictor, until: Any) -> None:
    with pytest.raises(InputError, match="until: expected a number of seconds"):
        nearest.solve(until=until)


@pytest.mark.parametrize("value", [True, np.True_])
def test_a_truth_value_is_no_number(nearest: Predictor, value: Any) -> None:
    with pytest.raises(InputError, match="mass: expected a number in kg, got True"):
        nearest.solve(parameters={"mass": value})


def test_a_gradient_is_not_lost_in_silence(nearest: Predictor) -> None:
    assert nearest.solve(parameters={"mass": torch.tensor(0.3)}).parameters["mass"] == pytest.approx(0.3)
    with pytest.raises(InputError, match=r"mass: .*Predictor\.torch"):
        nearest.solve(parameters={"mass": torch.tensor(0.3, requires_grad=True)})


ASKED: list[Callable[[Motion, Any], Any]] = [
    lambda motion, t: motion.vertices(t),
    lambda motion, t: motion.pose(t),
    lambda motion, t: motion.local(t),
]


@pytest.mark.parametrize("time", [float("nan"), [0.1, float("nan")], [[0.1]]], ids=str)
@pytest.mark.parametrize("ask", ASKED, ids=["vertices", "pose", "local"])
@pytest.mark.parametrize("name", ["mass-elastic", "kick", "contact-force", "mass-elastic/direct"])
def test_times_are_numbers(name: str, ask: Callable[[Motion, Any], Any], time: Any) -> None:
    motion = odeform.load(name).solve(until=0.0)
    with pytest.raises(InputError, match="time: expected seconds, a number or"):
        ask(motion, time)


@pytest.mark.parametrize("name", ["mass-elastic", "kick", "contact-force", "mass-elastic/gp", "mass-elastic/direct"])
def test_of_no_times_there_are_no_frames(name: str) -> None:
    motion = odeform.load(name).solve(until=0.0)
    count = len(motion.geometry.points)
    assert [ask(motion, np.array([])).shape for ask in ASKED] == [(0, count, 3), (0, 4, 4), (0, count, 3)]


@pytest.mark.parametrize("name", ["mass-elastic", "kick", "contact-force", "mass-elastic/gp", "mass-elastic/direct"])
def test_a_body_rests_before_its_motion_starts(name: str) -> None:
    motion = odeform.load(name).solve(until=0.1)
    assert np.array_equal(motion.vertices(-0.5), motion.geometry.points)
    assert np.array_equal(motion.vertices(np.array([-1e-3, 0.05]))[0], motion.geometry.points)


def test_times_of_a_file_may_be_a_list(motion: Motion, tmp_path: Path) -> None:
    odeform.write_motion(motion, [0.0, 0.1], tmp_path / "motion.npz")
    assert np.array_equal(np.load(tmp_path / "motion.npz")["vertices"], motion.vertices(np.array([0.0, 0.1])))
    with pytest.raises(InputError, match=r"none\.npz: times: expected at least one"):
        odeform.write_motion(motion, [], tmp_path / "none.npz")


@pytest.mark.parametrize("name", ["mass-elastic", "kick", "contact-force", "mass-elastic/gp"])
def test_models_open_where_numpy_raises_for_underflow(name: str) -> None:
    with np.errstate(all="raise"):
        assert odeform.load(name).schema.scene == name.partition("/")[0]


def test_what_was_wrong_in_a_file_is_still_known() -> None:
    damaged = replace(open_checkpoint("mass-elastic/nearest"), config={})
    with pytest.raises(InputError, match="checkpoint of nearest: missing or wrong") as caught:
        Nearest(damaged)
    assert isinstance(caught.value.__cause__, KeyError)


class Programmed(Nearest):
    """A model of a program that has a fault of its own."""

    fault: Exception = TypeError("none of the file's")

    def _read(self, checkpoint: Any) -> None:
        raise self.fault


def test_a_fault_of_a_program_is_its_own() -> None:
    checkpoint = open_checkpoint("mass-elastic/nearest")
    with pytest.raises(TypeError, match="none of the file's"):
        Programmed(checkpoint)


@pytest.mark.parametrize("fault", [KeyError("weights"), ValueError("weights: expected (3, 4)")])
def test_a_file_is_at_fault_where_a_program_says_so(fault: Exception, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Programmed, "fault", fault)
    with pytest.raises(InputError, match=r"checkpoint of nearest: missing or wrong .*weights") as caught:
        Programmed(open_checkpoint("mass-elastic/nearest"))
    assert caught.value.__cause__ is fault
