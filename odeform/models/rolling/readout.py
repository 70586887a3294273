"""How a rolling body is deformed, from the state of its motion: a linear readout of random features."""

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float

from odeform.arrays import finite_arrays
from odeform.mechanics.rolling.dynamics import STATE
from odeform.types import Arrays

__all__ = ["Readout", "inputs_of"]

NEAR = 0.02  # m above the touch over which a contact that comes is felt
INPUTS = 10  # besides the material


def inputs_of(
    states: Float[np.ndarray, "states rows"], touch: Float[np.ndarray, " rows"], material: Float[np.ndarray, "rows q"]
) -> Float[np.ndarray, "rows inputs"]:
    """What the deformation follows from: depths now and before, how the contact moves, and which side is down.

    States (8, R), the heights in m below which the floor is touched (R,), and the material (R, Q) -> (R, 10 + Q).
    """
    assert len(states) == STATE
    _, height, angle, ahead, rising, spin, one, two = states
    above = height - touch
    near = np.exp(-np.maximum(above, 0.0) / NEAR)
    deep = 100.0 * np.maximum(-above, 0.0)
    sides = [np.cos(angle), np.sin(angle), np.cos(2.0 * angle), np.sin(2.0 * angle)]
    moving = [near * rising, near * ahead, near * spin]
    return np.concatenate([np.stack([deep, one, two, *moving, *sides], axis=1), material], axis=1)


@dataclass(frozen=True, eq=False)
class Readout:
    """Amplitudes of patterns from inputs (R, I)."""

    mean: Float[np.ndarray, " inputs"]
    """Of the training inputs."""
    scale: Float[np.ndarray, " inputs"]
    """Their standard deviation."""
    directions: Float[np.ndarray, "inputs features"]
    phases: Float[np.ndarray, " features"]
    weights: Float[np.ndarray, "rows patterns"]
    """Of the features, the inputs, and a constant."""

    def features(self, inputs: Float[np.ndarray, "rows inputs"]) -> Float[np.ndarray, "rows features"]:
        """Random Fourier features (Rahimi and Recht 2008), the inputs, and one."""
        x = (inputs - self.mean) / self.scale
        return np.concatenate([np.cos(x @ self.directions + self.phases), x, np.ones((len(x), 1))], axis=1)

    def __call__(self, inputs: Float[np.ndarray, "rows inputs"]) -> Float[np.ndarray, "rows patterns"]:
        """Amplitudes (R, S) in m."""
        return self.features(inputs) @ self.weights

    def arrays(self) -> Arrays:
        """The arrays of a checkpoint, by name; `from_arrays` reads them."""
        return {f"readout.{field.name}": getattr(self, field.name) for field in fields(self)}

    @classmethod
    def from_arrays(cls, arrays: Arrays, materials: int, patterns: int) -> "Readout":
        """KeyError for a missing array, ValueError unless they are finite and fit each other."""
        inputs, count = INPUTS + materials, len(arrays["readout.phases"])
        shapes = {"mean": (inputs,), "scale": (inputs,), "directions": (inputs, count), "phases": (count,)}
        found = finite_arrays(arrays, "readout.", {**shapes, "weights": (count + inputs + 1, patterns)})
        if not (found["scale"] > 0.0).all():
            raise ValueError("readout.scale: expected positive numbers")
        return cls(**found)
