"""Other methods than explicit ones fit in: backward Euler, from outside of the package."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import odeform
from odeform.solver.integrate import SolverSettings, integrate
from odeform.solver.method import Field
from odeform.solver.registry import METHODS
from odeform.solver.solution import Status


class BackwardEulerStepper:
    """z1 = z0 + h f(t1, z1) by Newton's method, with a Jacobian by differences."""

    evaluations = 0

    def step(self, field: Field, time: float, state: Any, slope: Any, step: float) -> tuple[Any, Any]:
        after, count = state + step * slope, len(state)
        nudge = np.sqrt(np.finfo(state.dtype).eps)
        self.evaluations = 0
        for _ in range(4):
            slope = field(time + step, after)
            columns = [
                (field(time + step, after + nudge * unit) - slope) / nudge for unit in np.eye(count, dtype=state.dtype)
            ]
            jacobian = np.eye(count) - step * np.stack(columns, axis=1)
            after = (after - np.linalg.solve(jacobian, after - state - step * slope)).astype(state.dtype)
            self.evaluations += 1 + count
        self.evaluations += 1
        return after, field(time + step, after)

    def error(self, step: float) -> Any:
        raise NotImplementedError

    def middle(self, state: Any, step: float) -> Any:
        raise NotImplementedError


@dataclass(frozen=True)
class BackwardEuler:
    name: str = "backward-euler"
    order: int = 1
    controls_step: bool = False
    knows_middle: bool = False

    def stepper(self, start: Any) -> BackwardEulerStepper:
        return BackwardEulerStepper()


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(METHODS, "backward-euler", BackwardEuler())


def stiff(time: float, state: Any) -> Any:
    """Follows cos t; explicit methods need steps below 2 ms."""
    return -1000.0 * (state - np.cos(time))


def test_an_implicit_method_takes_large_steps_on_a_stiff_problem() -> None:
    implicit, explicit = (
        integrate(stiff, np.zeros(1), SolverSettings(name, step=0.05, dtype="float64"), until=1.0)
        for name in ("backward-euler", "euler")
    )
    assert implicit.status is Status.OK
    assert implicit.at(1.0)[0] == pytest.approx(np.cos(1.0), abs=1e-3)
    assert abs(explicit.at(1.0)[0]) > 1e6
    assert implicit.evaluations == 1 + 20 * 9


def test_a_model_integrates_by_it() -> None:
    motion = odeform.load("kick").solve(quality=SolverSettings("backward-euler", step=1 / 30), until=0.1)
    assert motion.stats.status == "ok"
    assert motion.stats.solver.startswith("backward-euler")


def test_its_steps_are_not_controlled() -> None:
    with pytest.raises(odeform.InputError, match="backward-euler cannot control its step"):
        SolverSettings("backward-euler", tolerance=1e-3)
