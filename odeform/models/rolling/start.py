"""Where a pushed body is, and how it moves, when the push is over: a kernel ridge regression on the parameters."""

import numpy as np
from jaxtyping import Float

from odeform.arrays import finite_arrays
from odeform.mechanics.rolling.dynamics import MOVING
from odeform.models.kernels.regression import Kernel, KernelRegression
from odeform.schema import Schema
from odeform.types import Arrays

__all__ = ["PUSHES", "push_inputs", "read_start", "start_arrays"]

PUSHES = ("force", "elevation")
"""Parameters that act through the push alone."""
MASS = "mass"
PREFIX = "start."
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


def start_arrays(regression: KernelRegression) -> Arrays:
    """The arrays of a checkpoint, by name, from the regression of position and velocity (6,): ahead, height (m), angle
    (rad), and their rates. `read_start` reads them."""
    assert regression.trend is not None
    scales = regression.kernel.scales
    arrays = {"inputs": regression.inputs / scales, "scales": scales}
    arrays |= {"weights": regression.weights, "linear": regression.trend}
    return {PREFIX + name: array for name, array in arrays.items()}


def read_start(arrays: Arrays, inputs: int) -> KernelRegression:
    """KeyError for a missing array, ValueError unless they are finite and fit each other."""
    count, size = len(arrays[f"{PREFIX}inputs"]), 2 * MOVING
    shapes = {"inputs": (count, inputs), "scales": (inputs,), "weights": (count, size), "linear": (1 + inputs, size)}
    found = finite_arrays(arrays, PREFIX, shapes)
    scales = found["scales"]
    if not (scales > 0.0).all():
        raise ValueError(f"{PREFIX}scales: expected positive numbers")
    return KernelRegression(Kernel(scales), found["inputs"] * scales, found["weights"], found["linear"])
