"""How a rolling body is deformed, from the state of its motion: a small network."""

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float

from odeform.arrays import finite_arrays
from odeform.mechanics.rolling.dynamics import STATE
from odeform.types import Arrays

__all__ = ["SIZE", "Readout", "inputs_of"]

NEAR = 0.02  # m above the contact height over which a contact that comes is felt
HIGHEST = 0.03  # m above the contact height from which on heights are alike
TURNS = np.arange(1, 17)  # how often each wave goes around the body: its mesh has corners
INPUTS = 7 + 2 * len(TURNS)  # besides the material
SIZE = 192
"""Hidden units of each of two layers."""


def inputs_of(
    states: Float[np.ndarray, "states rows"],
    contact_height: Float[np.ndarray, "#rows"],
    material: Float[np.ndarray, "#rows q"],
) -> Float[np.ndarray, "rows inputs"]:
    """Computes what the deformation follows from: depths now and before, how the contact moves, and which side is down.

    States (8, R), the heights in m below which the floor is touched (R,), and the material (R, Q) -> (R, 39 + Q).
    """
    assert len(states) == STATE
    _, height, angle, ahead, rising, spin, one, two = states
    above = height - contact_height
    near = np.exp(-np.maximum(above, 0.0) / NEAR)
    sides = angle[:, None] * TURNS
    out = np.empty((len(angle), INPUTS + material.shape[1]))
    out[:, 0], out[:, 1] = 100.0 * np.maximum(-above, 0.0), 50.0 * np.minimum(above, HIGHEST)
    out[:, 2], out[:, 3] = one, two
    out[:, 4], out[:, 5], out[:, 6] = near * rising, near * ahead, near * spin
    np.cos(sides, out=out[:, 7 : 7 + len(TURNS)])
    np.sin(sides, out=out[:, 7 + len(TURNS) : INPUTS])
    out[:, INPUTS:] = material
    return out


def _silu(x: Float[np.ndarray, "rows hidden"]) -> Float[np.ndarray, "rows hidden"]:
    return 0.5 * x * (1.0 + np.tanh(0.5 * x))


@dataclass(frozen=True, eq=False)
class Readout:
    """Amplitudes of patterns from inputs (R, I): three linear layers, with SiLU between them."""

    mean: Float[np.ndarray, " inputs"]
    """Mean of the training inputs."""
    scale: Float[np.ndarray, " inputs"]
    """Their standard deviation."""
    first: Float[np.ndarray, "inputs hidden"]
    first_bias: Float[np.ndarray, " hidden"]
    middle: Float[np.ndarray, "hidden hidden"]
    middle_bias: Float[np.ndarray, " hidden"]
    last: Float[np.ndarray, "hidden patterns"]
    last_bias: Float[np.ndarray, " patterns"]

    def __call__(self, inputs: Float[np.ndarray, "rows inputs"]) -> Float[np.ndarray, "rows patterns"]:
        """Predicts amplitudes (R, S) in m."""
        x = ((inputs - self.mean) / self.scale).astype(self.first.dtype)
        x = _silu(x @ self.first + self.first_bias)
        return _silu(x @ self.middle + self.middle_bias) @ self.last + self.last_bias

    def arrays(self) -> Arrays:
        """The arrays of a checkpoint, by name; `from_arrays` reads them."""
        return {f"readout.{field.name}": getattr(self, field.name) for field in fields(self)}

    @classmethod
    def from_arrays(cls, arrays: Arrays, materials: int, patterns: int) -> "Readout":
        """KeyError for a missing array, ValueError unless they are finite and fit each other."""
        inputs, hidden = INPUTS + materials, len(arrays["readout.first_bias"])
        shapes = {"mean": (inputs,), "scale": (inputs,), "first": (inputs, hidden), "first_bias": (hidden,)}
        shapes |= {"middle": (hidden, hidden), "middle_bias": (hidden,)}
        shapes |= {"last": (hidden, patterns), "last_bias": (patterns,)}
        found = finite_arrays(arrays, "readout.", shapes)
        if not (found["scale"] > 0.0).all():
            raise ValueError("readout.scale: expected positive numbers")
        return cls(**found)
