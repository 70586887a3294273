"""Kernel functions of inputs divided by length scales: Gaussian, and Matern of half-integer order (Rasmussen and
Williams 2006, eq. 4.16).

The order p is the number of times that a function drawn from the Gaussian process can be differentiated: the kernel is
Matern (p + 1/2), a polynomial of degree p times an exponential.
"""

from dataclasses import dataclass
from functools import cache
from math import factorial
from typing import Any

import numpy as np
from jaxtyping import Float

from odeform.types import Floats

__all__ = ["Known", "gaussian", "matern", "matern_slope", "scaled_distance"]

Inputs = Float[np.ndarray, "rows inputs"]


@dataclass(frozen=True, eq=False)
class Known:
    """Inputs with which many covariances are computed, divided by length scales, and their squared norms."""

    values: Inputs
    squares: Float[np.ndarray, " rows"]

    @classmethod
    def of(cls, values: Inputs) -> "Known":
        """Of inputs (S, D)."""
        return cls(values, (values**2).sum(axis=1))


def gaussian(one: Inputs, other: Float[np.ndarray, "columns inputs"]) -> Float[np.ndarray, "rows columns"]:
    """exp(-d^2 / 2), where d is the Euclidean distance."""
    squares = (one**2).sum(axis=-1)[:, None] + (other**2).sum(axis=-1)
    return np.exp(np.minimum(one @ other.T - 0.5 * squares, 0.0))


def matern(
    one: Inputs, other: Float[np.ndarray, "columns inputs"] | Known, order: int = 2
) -> Float[np.ndarray, "rows columns"]:
    """Kernel values; of order 2, (1 + r + r^2 / 3) exp(-r), where r is the scaled distance."""
    r = scaled_distance(one, other, order)
    return _at(_polynomial(order), r) * np.exp(-r)


def matern_slope(difference: Inputs, order: int = 2) -> Inputs:
    """Computes (rows, inputs): the derivative of the kernel by the first input, at differences `difference` from the
    second."""
    r = np.sqrt((2 * order + 1) * (difference**2).sum(axis=1))
    pull = _at(_polynomial(order - 1), r) * np.exp(-r)
    return -(2 * order + 1) / (2 * order - 1) * pull[:, None] * difference


def scaled_distance(
    one: Inputs, other: Float[np.ndarray, "columns inputs"] | Known, order: int = 2
) -> Float[np.ndarray, "rows columns"]:
    """Returns sqrt(2 p + 1) times the Euclidean distance."""
    known = other if isinstance(other, Known) else Known.of(other)
    squares = (one**2).sum(axis=1)[:, None] + known.squares - 2.0 * one @ known.values.T
    return np.sqrt((2.0 * order + 1.0) * np.maximum(squares, 0.0))


def _at(coefficients: tuple[float, ...], r: Floats) -> Floats:
    """The polynomial at r, the highest power first: `np.polyval` takes twice as long for so few values."""
    value: Any = coefficients[0]
    for coefficient in coefficients[1:]:
        value = value * r + coefficient
    return np.asarray(value)


@cache
def _polynomial(order: int) -> tuple[float, ...]:
    """Coefficients of the polynomial of degree `order`, of the highest power first."""
    p = order
    first = factorial(p) / factorial(2 * p)
    return tuple(first * factorial(p + i) / (factorial(i) * factorial(p - i)) * 2.0 ** (p - i) for i in range(p + 1))
