"""Defines what `integrate` knows of a method, explicit or implicit."""

from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

__all__ = ["Field", "Method", "Stepper"]

Field = Callable[[float, Any], Any]
"""(time in s, state (n,)) -> slope (n,)."""


@runtime_checkable
class Stepper(Protocol):
    """A method at work on states (n,) of one dtype; it may keep the stages of its last step."""

    evaluations: int
    """Evaluations of the field that the last step took."""

    def step(self, field: Field, time: float, state: Any, slope: Any, step: float) -> tuple[Any, Any]:
        """One step from `state` (n,) with `slope` (n,) at `time` in s: the state after it, and the slope there."""
        ...

    def error(self, step: float) -> Any:
        """(m,) estimated error of the last step, whose root mean square counts; only asked of methods that control
        their step."""
        ...

    def middle(self, state: Any, step: float) -> Any:
        """(n,) state halfway through the last step, which began at `state`; only asked of methods that know it."""
        ...


@runtime_checkable
class Method(Protocol):
    """A one-step method. Between its nodes a solution is the cubic Hermite interpolant of states and slopes.

    One that controls its step may have `gains` of its own, in place of `odeform.solver.step_control.GAINS`.
    """

    @property
    def name(self) -> str:
        """The name of the method."""
        ...

    @property
    def order(self) -> int:
        """Order of convergence of the global error."""
        ...

    @property
    def controls_step(self) -> bool:
        """Whether `Stepper.error` is there, so that a tolerance can choose the steps."""
        ...

    @property
    def knows_middle(self) -> bool:
        """Whether `Stepper.middle` is there, which makes the interpolant quartic."""
        ...

    def stepper(self, start: Any) -> Stepper:
        """Returns a stepper for states like `start`, an array (n,)."""
        ...
