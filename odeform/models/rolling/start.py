"""Where a pushed body is, and how it moves, when the push is over: a kernel ridge regression on the parameters, and
mechanics past the trained ranges."""

import numpy as np
from jaxtyping import Float

from odeform.arrays import finite_arrays
from odeform.mechanics.rolling.contact import RollingContact
from odeform.mechanics.rolling.dynamics import MOVING
from odeform.models.kernels.regression import Kernel, KernelRegression
from odeform.schema import Schema
from odeform.types import Arrays, Floats

__all__ = ["PUSHES", "Start", "push_inputs", "read_start", "start_arrays"]

PUSHES = ("force", "elevation")
"""Parameters that act through the push alone."""
MASS = "mass"
PREFIX = "start."
Vector6 = Float[np.ndarray, "6"]
UNIT = 100.0  # m/s^2
TRUSTED = 0.6
"""Fraction of the strongest trained push: beyond, spin is chance to the regression, and follows in proportion."""
LIFTING = (0.15, 0.45)
"""Elevations in rad between which a push begins to lift the body off the floor."""
STRAIGHT, TURNED = [0, 1, 3, 4], [2, 5]  # of the six numbers
PRESSING = (0.15, 0.6)
"""Downward pushes, in `UNIT`, between which the floor's answer is no longer as it was learned from level ones."""


def is_pushed(schema: Schema) -> bool:
    """Whether it is known how far a push accelerates the body."""
    return {MASS, *PUSHES} <= {p.name for p in schema.learned}


def push_inputs(schema: Schema, theta: Float[np.ndarray, "motions parameters"]) -> Float[np.ndarray, "motions inputs"]:
    """(M, P) in [-1, 1] -> (M, I): the material, and by how much the push accelerates the body ahead and up, in
    100 m/s^2. The parameters as they are in a scene without force, elevation or mass."""
    if not is_pushed(schema):
        return theta
    own, material = {}, []
    for normalised, parameter in zip(theta.T, schema.learned, strict=True):
        own[parameter.name] = np.array([parameter.denormalise(float(u)) for u in normalised])
        if parameter.name not in PUSHES:
            material.append(normalised)
    strength, elevation = own["force"] / (UNIT * own[MASS]), own["elevation"]
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


class Start:
    """Position and velocity (6,) for one theta (P,): those of the regression within the trained ranges.

    Past them, it is asked for a push of that direction that was trained, and its answer is scaled: so is the spin. But
    a push that lifts the body adds its impulse to the velocity; what presses it onto the floor is carried by the floor,
    and braked by friction.
    """

    def __init__(self, regression: KernelRegression, schema: Schema, contact: RollingContact) -> None:
        self._regression, self._schema, self._contact = regression, schema, contact
        self._pushed = is_pushed(schema)
        if self._pushed:
            strengths = regression.inputs[:, -2:]
            self._strongest = float(np.linalg.norm(strengths, axis=1).max())
            # what a steep push adds, in the middle of what was trained, is its impulse alone
            steep, middle = strengths[strengths[:, 1].argmax()], np.zeros(regression.inputs.shape[1])
            middle[-2:] = 0.5 * steep
            self._impulse = regression.jet(middle)[-2:][:, STRAIGHT]

    def __call__(self, theta: Floats) -> Vector6:
        """(P,) normalised parameters, as they are asked for."""
        asked, inside = push_inputs(self._schema, theta[None])[0], np.clip(theta, -1.0, 1.0)
        if not self._pushed or np.array_equal(theta, inside):
            return self._regression(asked[None])[0]
        out = self._scaled(asked, self._strongest)
        out[TURNED] = self._scaled(asked, TRUSTED * self._strongest)[TURNED]
        ahead, up = asked[-2:]
        part = max(_between(float(np.arctan2(up, ahead)), LIFTING), _between(-up, PRESSING))
        out[STRAIGHT] += part * (self._straight(asked, inside) - out[STRAIGHT])
        return out

    def _scaled(self, asked: Floats, strongest: float) -> Vector6:
        """Returns the state after a push no stronger than `strongest`, scaled."""
        times = max(float(np.linalg.norm(asked[-2:])) / strongest, 1.0)
        return times * self._regression(np.concatenate([asked[:-2], asked[-2:] / times])[None])[0]

    def _straight(self, asked: Floats, inside: Floats) -> Float[np.ndarray, "4"]:
        """Position and velocity ahead and up."""
        known = push_inputs(self._schema, inside[None])[0]
        begun, (ahead, up) = self._regression(known[None])[0, STRAIGHT], asked[-2:] - known[-2:]
        if asked[-1] < 0.0:
            # what is pressed stays down
            friction = float(np.exp(self._contact.coefficients(known[None, :-2])["friction"][0]))
            ahead, up, begun[1::2] = ahead + friction * asked[-1], 0.0, np.minimum(begun[1::2], 0.0)
        return begun + np.array([ahead, up]) @ self._impulse


def _between(value: float, ends: tuple[float, float]) -> float:
    """From 0 to 1 between two ends, smoothly."""
    part = min(max((value - ends[0]) / (ends[1] - ends[0]), 0.0), 1.0)
    return part**2 * (3.0 - 2.0 * part)
