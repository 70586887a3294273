"""Where a pushed body is, and how it moves, when the push is over: a kernel ridge regression on the parameters."""

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float

from odeform.arrays import finite_arrays
from odeform.mechanics.rolling.dynamics import MOVING
from odeform.models.matern import matern
from odeform.schema import Schema
from odeform.types import Arrays

__all__ = ["PUSHES", "Start", "push_inputs"]

PUSHES = ("force", "elevation")
"""Parameters that act through the push alone."""
MASS = "mass"
UNIT = 100.0  # m/s^2


def push_inputs(schema: Schema, theta: Float[np.ndarray, "motions parameters"]) -> Float[np.ndarray, "motions inputs"]:
    """(M, P) in [-1, 1] -> (M, I): the material, and by how much the push accelerates the body ahead and up, in
    100 m/s^2. The parameters as they are in a scene without force, elevation or mass."""
    if not {MASS, *PUSHES} <= {p.name for p in schema.learned}:
        return theta
    own = {p.name: np.array([p.denormalise(float(u)) for u in theta[:, i]]) for i, p in enumerate(schema.learned)}
    force, elevation, mass = (own[name] for name in (*PUSHES, MASS))
    strength = force / (UNIT * mass)
    material = [theta[:, i] for i, p in enumerate(schema.learned) if p.name not in PUSHES]
    return np.stack([*material, strength * np.cos(elevation), strength * np.sin(elevation)], axis=1)


@dataclass(frozen=True, eq=False)
class Start:
    """Position and velocity at one moment: linear in the inputs, and a rest; the kernel is Matern 5/2."""

    inputs: Float[np.ndarray, "sequences inputs"]
    """Of the training motions, divided by the length scales."""
    scales: Float[np.ndarray, " inputs"]
    weights: Float[np.ndarray, "sequences 6"]
    linear: Float[np.ndarray, "rows 6"]
    """Of one, and of the inputs."""

    def at(self, inputs: Float[np.ndarray, "motions inputs"]) -> Float[np.ndarray, "motions 6"]:
        """(M, I) -> (M, 6): ahead, height (m), angle (rad), and their rates."""
        return self.linear[0] + inputs @ self.linear[1:] + matern(inputs / self.scales, self.inputs) @ self.weights

    def arrays(self) -> Arrays:
        """The arrays of a checkpoint, by name; `from_arrays` reads them."""
        return {f"start.{field.name}": getattr(self, field.name) for field in fields(self)}

    @classmethod
    def from_arrays(cls, arrays: Arrays, inputs: int) -> "Start":
        """KeyError for a missing array, ValueError unless they are finite and fit each other."""
        count, size = len(arrays["start.inputs"]), 2 * MOVING
        shapes = {
            "inputs": (count, inputs),
            "scales": (inputs,),
            "weights": (count, size),
            "linear": (1 + inputs, size),
        }
        found = finite_arrays(arrays, "start.", shapes)
        if not (found["scales"] > 0.0).all():
            raise ValueError("start.scales: expected positive numbers")
        return cls(**found)
