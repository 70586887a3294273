"""Single steps of Kutta's two fourth-order rules (1901), for arrays or tensors, in the precision that comes in."""

from collections.abc import Callable
from typing import Any

__all__ = ["classic", "three_eighths"]


def classic(field: Callable[[Any, Any], Any], state: Any, length: Any, begin: Any, middle: Any, end: Any) -> Any:
    """The state after a step of `length` of dz/dt = field(z, t) by the classic rule, known as RK4.

    `begin`, `middle` and `end` are what the field is given for t at the start, in the middle and at the end.
    """
    k1 = field(state, begin)
    k2 = field(state + 0.5 * length * k1, middle)
    k3 = field(state + 0.5 * length * k2, middle)
    k4 = field(state + length * k3, end)
    return state + length / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


def three_eighths(field: Callable[[Any, Any], Any], state: Any, begin: Any, end: Any) -> Any:
    """The state at time `end` of dz/dt = field(z, t) from `state` at time `begin`, by the 3/8 rule, which the paper's
    authors use."""
    length = end - begin
    k1 = length * field(state, begin)
    k2 = length * field(state + k1 / 3.0, begin + length / 3.0)
    k3 = length * field(state + k2 - k1 / 3.0, begin + length * 2.0 / 3.0)
    k4 = length * field(state + k1 - k2 + k3, end)
    return state + (k1 + 3.0 * (k2 + k3) + k4) / 8.0
