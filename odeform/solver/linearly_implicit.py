"""Extrapolated linearly implicit Euler steps (Deuflhard, Hairer and Zugck 1987; LIMEX), for stiff fields."""

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

from odeform.errors import InputError
from odeform.solver.method import Field

__all__ = ["LinearlyImplicit", "StiffField"]


@runtime_checkable
class StiffField(Protocol):
    """A field that knows how to solve for its own steps."""

    def __call__(self, time: float, state: Any) -> Any:
        """Returns the slope (n,) at `time` in s."""
        ...

    def advance(self, time: float, state: Any, step: float) -> tuple[Any, Any, float]:
        """The state (n,) after `step` seconds, to second order, the slope there, and the estimated error of the step
        in the field's own unit."""
        ...


class _Stepper:
    """Steps of a `StiffField`."""

    evaluations = 3  # a whole step and two halves

    def __init__(self) -> None:
        self._error = np.zeros(1)
        self._known: StiffField | None = None

    def step(self, field: Field, time: float, state: Any, slope: Any, step: float) -> tuple[Any, Any]:
        """One step from `state` (n,) at `time` in s: the state after it, and the slope there."""
        if self._known is None or field is not self._known:
            # asking a protocol takes as long as several array operations
            if not isinstance(field, StiffField):
                raise InputError("solver limex: expected the field of a mechanical model")
            self._known = field
        with np.errstate(all="ignore"):  # an overflow ends the integration with a status
            after, slope, error = self._known.advance(time, state, step)
        self._error = np.array([error])
        return after, slope

    def error(self, step: float) -> Any:
        """(1,) as the field estimates it."""
        return self._error

    def middle(self, state: Any, step: float) -> Any:
        """Not asked for."""
        raise NotImplementedError


@dataclass(frozen=True)
class LinearlyImplicit:
    """One whole step and two half steps of linearly implicit Euler, extrapolated to second order."""

    name: str = "limex"
    order: int = 2
    controls_step: bool = True
    gains: tuple[float, float] = (0.8, 0.2)  # a seventh fewer steps than with those of explicit methods, at equal error
    knows_middle: bool = False

    def stepper(self, start: Any) -> _Stepper:
        """Makes the step for states like `start`, an array (n,)."""
        return _Stepper()
