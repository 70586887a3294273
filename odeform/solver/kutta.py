"""Kutta's 3/8 rule (1901), which the paper's authors integrate by: one step, of whatever arrays or tensors."""

from collections.abc import Callable
from typing import Any

__all__ = ["three_eighths"]


def three_eighths(field: Callable[[Any, Any], Any], state: Any, begin: Any, end: Any) -> Any:
    """The state at time `end` of dz/dt = field(z, t), from `state` at time `begin`; in the precision that comes in."""
    length = end - begin
    k1 = length * field(state, begin)
    k2 = length * field(state + k1 / 3.0, begin + length / 3.0)
    k3 = length * field(state + k2 - k1 / 3.0, begin + length * 2.0 / 3.0)
    k4 = length * field(state + k1 - k2 + k3, end)
    return state + (k1 + 3.0 * (k2 + k3) + k4) / 8.0
