"""Explicit Runge-Kutta steps: slopes, and weighted sums of them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import get_blas_funcs

from odeform.solver.method import Field
from odeform.solver.tableau import Row, Tableau, rounded
from odeform.types import Floats

__all__ = ["ExplicitRungeKutta", "Stages", "gemv"]


def gemv(dtype: np.dtype) -> Callable[..., Any]:
    """(alpha, a, x, beta=0, y=0) -> alpha a x + beta y: by BLAS, or by numpy in precisions that BLAS lacks."""
    if dtype.char in "fd":
        return get_blas_funcs(("gemv",), dtype=dtype)[0]
    return lambda alpha, a, x, beta=0.0, y=0.0: alpha * (a @ x) + beta * y


class Stages:
    """The slopes within a step by `tableau`, for states like `start`: arrays (n,) of one dtype.

    The slopes are columns of one array: for small states, a sum as one matrix product costs a fraction of a sum term by
    term.
    """

    def __init__(self, tableau: Tableau, start: Any) -> None:
        dtype = start.dtype
        rows: tuple[Row, ...] = (*tableau.a[1:], *(() if tableau.fsal else (tableau.b,)))
        nodes = [float(node) for node in (*tableau.c[1:], *(() if tableau.fsal else (1,)))]
        self.evaluations = len(rows)
        """Evaluations of the field per step."""
        self._slopes = np.empty((len(start), self.evaluations + 1), dtype, order="F")
        self._product = gemv(dtype)
        weighted = [self._weighted(rounded(row, dtype)) for row in rows]
        self._stages = list(zip(range(1, len(rows) + 1), weighted, nodes, strict=True))
        self._error = self._weighted(_error_weights(tableau, dtype))
        self._middle = self._weighted(rounded(tableau.middle or (), dtype))

    def _weighted(self, weights: Floats) -> tuple[Floats, Floats]:
        """The slopes that weights belong to, and the weights."""
        return self._slopes[:, : len(weights)], weights

    def _advanced(self, state: Any, weighted: tuple[Floats, Floats], step: float) -> Any:
        """state + step * sum_i weights[i] slopes[i]"""
        slopes, weights = weighted
        return self._product(step, slopes, weights, 1.0, state)

    def step(self, field: Field, time: float, state: Any, slope: Any, step: float) -> tuple[Any, Any]:
        """One step from `state` (n,) with `slope` (n,) at `time`: the state after it, and the slope there."""
        after = state
        self._slopes[:, 0] = slope
        for index, weighted, node in self._stages:
            after = self._advanced(state, weighted, step)
            slope = field(time + node * step, after)
            self._slopes[:, index] = slope
        return after, slope

    def error(self, step: float) -> Any:
        """(n,) error of the last step as the embedded method estimates it."""
        slopes, weights = self._error
        return self._product(step, slopes, weights)

    def middle(self, state: Any, step: float) -> Any:
        """(n,) state halfway through the last step, which began at `state`."""
        return self._advanced(state, self._middle, step)


def _error_weights(tableau: Tableau, dtype: np.dtype) -> Floats:
    """(s,) b - embedded; each is rounded first, which step control has always been computed with."""
    if tableau.embedded is None:
        return np.empty(0, dtype)
    wide = np.promote_types(dtype, np.float64)
    return (rounded(tableau.b, wide) - rounded(tableau.embedded, wide)).astype(dtype)


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
        """For states like `start`, an array (n,)."""
        return Stages(self.tableau, start)
