"""Kernel regression: the one that all models use, whatever it is a function of."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from odeform.models.kernels.functions import Known, gaussian, matern, matern_slope
from odeform.types import Floats

__all__ = ["Kernel", "KernelRegression", "LinearTerm"]

Inputs = Float[np.ndarray, "rows inputs"]


@dataclass(frozen=True, eq=False)
class LinearTerm:
    """v matern(c / m, c' / m) f.f': linear in the force f, which the last three inputs are, with a response that varies
    with the place c, the first P inputs (Rasmussen and Williams 2006, 4.2)."""

    scales: Float[np.ndarray, " places"]
    """m."""
    variance: float
    """v."""


@dataclass(frozen=True, eq=False)
class Kernel:
    """A Matern or Gaussian kernel of the first D inputs, with a length scale for each; and a linear term, or none."""

    scales: Float[np.ndarray, " inputs"]
    """(D,)"""
    order: int | None = 2
    """Order of the Matern kernel; None for the Gaussian one."""
    linear: LinearTerm | None = None

    def __call__(self, x: Inputs, other: Float[np.ndarray, "columns inputs"]) -> Float[np.ndarray, "rows columns"]:
        """Covariances between two sets of inputs, in units of the signal."""
        return self.with_known(x, *self.known(other))

    def known(self, other: Inputs) -> tuple[Known, Known | None, Floats]:
        """What covariances with inputs (S, D) take: these by their scales, the places of the linear term by theirs, and
        the forces."""
        size = len(self.scales)
        places = None if self.linear is None else Known.of(self._places(other, self.linear))
        return Known.of(other[:, :size] / self.scales), places, other[:, size:]

    def with_known(
        self, x: Inputs, known: Known, places: Known | None, forces: Float[np.ndarray, "columns axes"]
    ) -> Float[np.ndarray, "rows columns"]:
        """Covariances (R, S) of inputs (R, D) with `known` ones."""
        size = len(self.scales)
        one = x[:, :size] / self.scales
        out = gaussian(one, known.values) if self.order is None else matern(one, known, self.order)
        if self.linear is not None:
            assert places is not None
            near = matern(self._places(x, self.linear), places)
            out = out + self.linear.variance * near * (x[:, size:] @ forces.T)
        return out

    @staticmethod
    def _places(x: Inputs, linear: LinearTerm) -> Floats:
        return x[:, : len(linear.scales)] / linear.scales

    def slopes(self, x: Float[np.ndarray, " inputs"], other: Inputs) -> Float[np.ndarray, "inputs rows"]:
        """Computes (D, S): derivatives of the covariances with S others by each input; Matern kernels without a linear
        term."""
        assert self.order is not None
        assert self.linear is None
        return (matern_slope((x - other) / self.scales, self.order) / self.scales).T


@dataclass(frozen=True, eq=False)
class KernelRegression:
    """Outputs (M,) of inputs (D,): kernels around the S known inputs, and a linear trend, or none."""

    kernel: Kernel
    inputs: Float[np.ndarray, "known inputs"]
    weights: Float[np.ndarray, "known outputs"]
    trend: Float[np.ndarray, "terms outputs"] | None = None
    """(1 + D, M): a constant, and what each input adds."""

    def __call__(self, x: Inputs) -> Float[np.ndarray, "rows outputs"]:
        """Evaluates the regression at inputs (R, D)."""
        out = self.kernel.with_known(x, *self._known) @ self.weights
        return out if self.trend is None else self.trend[0] + x @ self.trend[1:] + out

    @cached_property
    def _known(self) -> tuple[Known, Known | None, Floats]:
        return self.kernel.known(self.inputs)

    def jet(self, x: Float[np.ndarray, " inputs"]) -> Float[np.ndarray, "jet outputs"]:
        """Computes (1 + D, M) at one input (D,): the value, and its derivatives by each input."""
        slopes = self.kernel.slopes(x, self.inputs) @ self.weights
        return np.concatenate([self(x[None]), slopes if self.trend is None else slopes + self.trend[1:]])
