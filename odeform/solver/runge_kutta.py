"""Explicit Runge-Kutta steps: slopes, and weighted sums of them."""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import get_blas_funcs

from odeform.solver.method import Field
from odeform.solver.tableau import Row, Tableau, rounded
from odeform.types import Floats

__all__ = ["ExplicitRungeKutta", "Stages", "Weights", "gemv", "weights_of"]


def gemv(dtype: np.dtype) -> Callable[..., Any]:
    """Maps (alpha, a, x, beta=0, y=0) to alpha a x + beta y: by BLAS, or by numpy in precisions that BLAS lacks."""
    if dtype.char in "fd":
        return get_blas_funcs(("gemv",), dtype=dtype)[0]
    return lambda alpha, a, x, beta=0.0, y=0.0: alpha * (a @ x) + beta * y


class Stages:
    """The slopes within a step by `tableau`, for states like `start`: arrays (n,) of one dtype.

    The slopes are columns of one array: for small states, a sum as one matrix product costs a fraction of a sum term by
    term.
    """

    def __init__(self, tableau: Tableau, start: Any) -> None:
        weights = weights_of(tableau, start.dtype)
        self.evaluations = len(weights.stages)
        """Evaluations of the field per step."""
        self._slopes = np.empty((len(start), self.evaluations + 1), start.dtype, order="F")
        self._product = gemv(start.dtype)
        stages = [self._weighted(row) for row in weights.stages]
        self._stages = list(zip(range(1, len(stages) + 1), stages, weights.nodes, strict=True))
        self._error = self._weighted(weights.error)
        self._middle = self._weighted(weights.middle)

    def _weighted(self, weights: Floats) -> tuple[Floats, Floats]:
        """The slopes that weights belong to, and the weights."""
        return self._slopes[:, : len(weights)], weights

    def _advanced(self, state: Any, weighted: tuple[Floats, Floats], step: float) -> Any:
        """state + step * sum_i weights[i] slopes[i]"""
        slopes, weights = weighted
        return self._product(step, slopes, weights, 1.0, state)

    def step(self, field: Field, time: float, state: Any, slope: Any, step: float) -> tuple[Any, Any]:
        """One step from `state` (n,) with `slope` (n,) at `time`: the state after it, and the slope there."""
        after, kept, product = state, self._slopes, self._product
        kept[:, 0] = slope
        for index, (slopes, weights), node in self._stages:
            after = product(step, slopes, weights, 1.0, state)
            slope = field(time + node * step, after)
            kept[:, index] = slope
        return after, slope

    def error(self, step: float) -> Any:
        """(n,) error of the last step as the embedded method estimates it."""
        slopes, weights = self._error
        return self._product(step, slopes, weights)

    def middle(self, state: Any, step: float) -> Any:
        """(n,) state halfway through the last step, which began at `state`."""
        return self._advanced(state, self._middle, step)


class Weights(NamedTuple):
    """A tableau in one precision."""

    stages: list[Floats]
    nodes: list[float]
    error: Floats
    middle: Floats


@cache  # rounding fractions takes longer than a few steps
def weights_of(tableau: Tableau, dtype: np.dtype) -> Weights:
    """Round the weights of a tableau to a precision."""
    last: tuple[Row, ...] = () if tableau.fsal else (tableau.b,)
    nodes = (*tableau.c[1:], *(Fraction(1) for _ in last))
    error = np.empty(0, dtype)
    if tableau.embedded is not None:
        # both are rounded before they are subtracted, which step control has always been computed with
        wide = np.promote_types(dtype, np.float64)
        error = (rounded(tableau.b, wide) - rounded(tableau.embedded, wide)).astype(dtype)
    return Weights(
        [rounded(row, dtype) for row in (*tableau.a[1:], *last)],
        [float(node) for node in nodes],
        error,
        rounded(tableau.middle or (), dtype),
    )


@dataclass(frozen=True)
class ExplicitRungeKutta:
    """The method of a tableau."""

    tableau: Tableau

    @property
    def name(self) -> str:
        """Name of the method."""
        return self.tableau.name

    @property
    def order(self) -> int:
        """Order of convergence."""
        return self.tableau.order

    @property
    def controls_step(self) -> bool:
        """Whether there is an embedded method."""
        return self.tableau.embedded is not None

    @property
    def knows_middle(self) -> bool:
        """Whether the interpolant is quartic."""
        return self.tableau.middle is not None

    def stepper(self, start: Any) -> Stages:
        """Makes the step for states like `start`, an array (n,)."""
        return Stages(self.tableau, start)
