"""The stages of a Runge-Kutta step: slopes, and weighted sums of them."""

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
from scipy.linalg import get_blas_funcs

from odeform.solver.tableau import Tableau

__all__ = ["Field", "Stages", "gemv"]

Field = Callable[[float, Any], Any]
EXACT = 10**6  # denominators of tableaux are smaller


def gemv(dtype: np.dtype) -> Callable[..., Any]:
    """(alpha, a, x, beta=0, y=0) -> alpha a x + beta y: of BLAS, or, in precisions that it does not know, of numpy."""
    if dtype.char in "fd":
        return get_blas_funcs(("gemv",), dtype=dtype)[0]
    return lambda alpha, a, x, beta=0.0, y=0.0: alpha * (a @ x) + beta * y


class Stages:
    """The slopes within a step of `method` from states like `start`, arrays (n,).

    They are columns of one array: for small states a sum as one product costs a fraction of one term by term.
    """

    def __init__(self, method: Tableau, start: Any) -> None:
        self.method = method
        rows = [*method.a[1:], *(() if method.fsal else (method.b,))]
        nodes = (*method.c[1:], *(() if method.fsal else (1.0,)))
        self.evaluations = len(rows)
        """What a step takes."""
        self._slopes = np.empty((len(start), self.evaluations + 1), start.dtype, order="F")
        self._product = gemv(start.dtype)
        weighed = [self._weigh(row) for row in rows]
        self._stages = list(zip(range(1, len(rows) + 1), weighed, nodes, strict=True))
        self._error = self._weigh(method.error or ())
        self._middle = self._weigh(method.middle or ())

    def _weigh(self, row: tuple[float, ...]) -> Any:
        dtype = self._slopes.dtype
        if dtype.char in "fd":
            return self._slopes[:, : len(row)], np.array(row, dtype)
        # beyond double precision the fractions that the numbers stand for
        fractions = [Fraction(weight).limit_denominator(EXACT) for weight in row]
        exact = [dtype.type(f.numerator) / dtype.type(f.denominator) for f in fractions]
        return self._slopes[:, : len(row)], np.array(exact, dtype)

    def _ahead(self, state: Any, weighed: Any, step: float) -> Any:
        """state + step * sum_i weights[i] slopes[i]"""
        slopes, weights = weighed
        return self._product(step, slopes, weights, 1.0, state)

    def step(self, field: Field, time: float, state: Any, slope: Any, step: float) -> tuple[Any, Any]:
        """The state after one step, and the slope there."""
        after = state
        self._slopes[:, 0] = slope
        for index, weighed, node in self._stages:
            after = self._ahead(state, weighed, step)
            slope = field(time + node * step, after)
            self._slopes[:, index] = slope
        return after, slope

    def error(self, step: float) -> Any:
        """What the embedded method says that the last step is off."""
        slopes, weights = self._error
        return self._product(step, slopes, weights)

    def middle(self, state: Any, step: float) -> Any:
        """The state halfway through the last step, from `state`."""
        return self._ahead(state, self._middle, step)
