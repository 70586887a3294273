"""Where a pushed body is, and how it moves, when the push is over: a kernel ridge regression on the parameters."""

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float

from odeform.arrays import finite_arrays
from odeform.mechanics.rolling.dynamics import MOVING
from odeform.models.contact.kernel import matern
from odeform.types import Arrays

__all__ = ["Start"]


@dataclass(frozen=True, eq=False)
class Start:
    """Position and velocity at one moment; the kernel is Matern 5/2."""

    theta: Float[np.ndarray, "sequences parameters"]
    """Training parameters, divided by the length scales."""
    scales: Float[np.ndarray, " parameters"]
    weights: Float[np.ndarray, "sequences 6"]
    mean: Float[np.ndarray, "6"]

    def at(self, theta: Float[np.ndarray, "motions parameters"]) -> Float[np.ndarray, "motions 6"]:
        """(M, P) in [-1, 1] -> (M, 6): ahead, height (m), angle (rad), and their rates."""
        return self.mean + matern(theta / self.scales, self.theta) @ self.weights

    def arrays(self) -> Arrays:
        """The arrays of a checkpoint, by name; `from_arrays` reads them."""
        return {f"start.{field.name}": getattr(self, field.name) for field in fields(self)}

    @classmethod
    def from_arrays(cls, arrays: Arrays, parameters: int) -> "Start":
        """KeyError for a missing array, ValueError unless they are finite and fit each other."""
        count, size = len(arrays["start.theta"]), 2 * MOVING
        shapes = {"theta": (count, parameters), "scales": (parameters,), "weights": (count, size), "mean": (size,)}
        found = finite_arrays(arrays, "start.", shapes)
        if not (found["scales"] > 0.0).all():
            raise ValueError("start.scales: expected positive numbers")
        return cls(**found)
