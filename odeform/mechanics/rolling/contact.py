"""Holds what is learned of a rolling body: how the floor pushes it, as functions of its material and its motion.

Each coefficient is the exponential of a quadratic function of the material. A small network of the depth and the
velocities of the contact adds to some of the exponents. It changes how strong forces are, never which way they point:
the floor only pushes, friction only brakes. Without the network, a bounce on a round body gives no energy.
"""

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float

from odeform.arrays import finite_arrays
from odeform.types import Arrays, Floats

__all__ = [
    "ADJUSTED",
    "COEFFICIENTS",
    "HIDDEN",
    "INPUTS",
    "PLACES",
    "PLAIN",
    "REACHING",
    "RollingContact",
    "initial_contact",
    "material_terms",
]

COEFFICIENTS = {
    "stiffness": 4.2,  # of the floor's push, m/s^2 at a depth of 1 cm
    "power": 0.16,  # of the depth that it grows with
    "damping": -0.1,  # s/m at a depth of 1 cm
    "damping_power": -2.0,  # of the depth that damping grows with: the logarithm of its odds
    "friction": -0.8,  # Coulomb coefficient
    "regularisation": -1.7,  # m/s of sliding at which friction sets in
    "rolling": -6.5,  # lever in m by which the push brakes rolling
    "inertia": -0.4,  # about the axis, relative to mass and squared radius
    "corners": -0.5,  # weight of the corners of the mesh
}
"""Logarithms to start from, by name. Besides, `height` and `radius` are quadratic functions themselves."""
PLAIN = {"height": 1.0, "radius": 0.0}
"""The contact height: mm above the height at rest from which on the floor is touched, and the lever of friction, in
tenths of a radius more than one."""
ADJUSTED = ("stiffness", "damping", "friction", "rolling", "regularisation", "corners")
"""Coefficients whose logarithm the network adds to."""
PLACES, REACHING = np.linspace(-0.6, 0.6, 13), 0.1
"""Angles in rad about the place that the body rested on, where its weight has settled it, and how far each reaches."""
HIDDEN = 16
INPUTS = 4
"""The network's inputs besides the material: depth, velocity up, of sliding and ahead."""


@dataclass(frozen=True, eq=False)
class RollingContact:
    """Holds the contact parameters of a rolling body, and their network."""

    terms: Float[np.ndarray, "coefficients terms"]
    """Coefficients of quadratic functions of the material, in the order of `COEFFICIENTS` and `PLAIN`."""
    settled: Float[np.ndarray, "places linear"]
    """Coefficients of linear functions of the material: mm by which the body stands higher at each of `PLACES`."""
    first: Float[np.ndarray, "inputs hidden"]
    bias: Float[np.ndarray, " hidden"]
    last: Float[np.ndarray, "hidden adjusted"]

    def flat(self) -> Float[np.ndarray, " numbers"]:
        """Returns all numbers in one axis."""
        return np.concatenate([getattr(self, field.name).ravel() for field in fields(self)])

    def like(self, flat: Float[np.ndarray, " numbers"]) -> "RollingContact":
        """Makes contact parameters of the same sizes with the numbers (n,) of `flat`."""
        shapes = [getattr(self, field.name).shape for field in fields(self)]
        parts = np.split(flat, np.cumsum([np.prod(shape) for shape in shapes])[:-1])
        return RollingContact(*(part.reshape(shape) for part, shape in zip(parts, shapes, strict=True)))

    def coefficients(self, material: Float[np.ndarray, "motions materials"]) -> dict[str, Floats]:
        """Returns by name (M,), for materials (M, Q): logarithms of `COEFFICIENTS`, and `PLAIN`."""
        found = self.terms @ material_terms(material).T
        return dict(zip([*COEFFICIENTS, *PLAIN], found, strict=True))

    def arrays(self) -> Arrays:
        """The arrays of a checkpoint, by name; `from_arrays` reads them."""
        return {f"law.{field.name}": getattr(self, field.name) for field in fields(self)}

    @classmethod
    def from_arrays(cls, arrays: Arrays, materials: int) -> "RollingContact":
        """KeyError for a missing array, ValueError unless they are finite and of their shapes."""
        like = initial_contact(materials, 0)
        return cls(**finite_arrays(arrays, "law.", {f.name: getattr(like, f.name).shape for f in fields(cls)}))


def material_terms(material: Float[np.ndarray, "motions materials"]) -> Float[np.ndarray, "motions terms"]:
    """Maps (M, Q) to (M, 1 + Q + Q (Q + 1) / 2): one, the values, and their products."""
    left, right = np.triu_indices(material.shape[1])
    return np.concatenate([np.ones((len(material), 1)), material, material[:, left] * material[:, right]], axis=1)


def initial_contact(materials: int, seed: int) -> RollingContact:
    """Makes the contact parameters that a training starts from: they do not depend on the material, and the network
    adds nothing yet."""
    rng, inputs = np.random.default_rng(seed), INPUTS + materials
    starts = [*COEFFICIENTS.values(), *PLAIN.values()]
    terms = np.zeros((len(starts), material_terms(np.zeros((1, materials))).shape[1]))
    terms[:, 0] = starts
    return RollingContact(
        terms,
        np.zeros((len(PLACES), 1 + materials)),
        0.7 * rng.normal(size=(inputs, HIDDEN)),
        0.5 * rng.normal(size=HIDDEN),
        0.01 * rng.normal(size=(HIDDEN, len(ADJUSTED))),
    )
