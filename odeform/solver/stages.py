"""The stages of a Runge-Kutta step: slopes, and weighted sums of them."""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.linalg import get_blas_funcs

from odeform.solver.tableau import Tableau

__all__ = ["Field", "Stages", "TensorStages"]

Field = Callable[[float, Any], Any]


class Stages:
    """The slopes within a step of `method` from states like `start`, arrays of any shape.

    They are columns of one array: for small states a sum as one product costs a fraction of one term by term.
    """

    def __init__(self, method: Tableau, start: Any) -> None:
        self._method = method
        self._rows = [*method.a[1:], *(() if method.fsal else (method.b,))]
        self._nodes = (*method.c[1:], *(() if method.fsal else (1.0,)))
        self._keep(start)

    def _keep(self, start: Any) -> None:
        self._slopes = np.empty((start.size, len(self._rows) + 1), start.dtype, order="F")
        self._product = get_blas_funcs("gemv", dtype=start.dtype)
        rows = {*self._rows, self._method.error or (), self._method.middle or ()}
        self._weighed = {row: (self._slopes[:, : len(row)], np.array(row, start.dtype)) for row in rows}

    def _put(self, index: int, slope: Any) -> None:
        self._slopes[:, index] = slope.ravel()

    def _ahead(self, state: Any, weights: tuple[float, ...], step: float) -> Any:
        """state + step * sum_i weights[i] slopes[i]"""
        slopes, row = self._weighed[weights]
        return self._product(step, slopes, row, 1.0, state.ravel()).reshape(state.shape)

    def step(self, field: Field, time: float, state: Any, slope: Any, step: float) -> tuple[Any, Any]:
        """The state after one step, and the slope there. It takes `evaluations`."""
        self._put(0, slope)
        for index, (weights, node) in enumerate(zip(self._rows, self._nodes, strict=True), start=1):
            after = self._ahead(state, weights, step)
            slope = field(time + node * step, after)
            self._put(index, slope)
        return after, slope  # pyright: ignore[reportPossiblyUnbound]

    @property
    def evaluations(self) -> int:
        return len(self._rows)

    def error(self, state: Any, step: float) -> Any:
        """What the embedded method says that the last step, from `state`, is off."""
        assert self._method.error is not None
        return self._ahead(np.zeros_like(state), self._method.error, step)

    def middle(self, state: Any, step: float) -> Any:
        """The state halfway through the last step, from `state`."""
        assert self._method.middle is not None
        return self._ahead(state, self._method.middle, step)


class TensorStages(Stages):
    """The same for torch: term by term, which keeps gradients."""

    def _keep(self, start: Any) -> None:
        self._list: list[Any] = [None] * (len(self._rows) + 1)

    def _put(self, index: int, slope: Any) -> None:
        self._list[index] = slope

    def _ahead(self, state: Any, weights: tuple[float, ...], step: float) -> Any:
        for weight, slope in zip(weights, self._list, strict=False):
            if weight:
                state = state + (weight * step) * slope
        return state
