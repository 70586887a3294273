"""Deformations of a body that rolls, in axes that do not roll with it.

Where a round body touches the floor it is dented. The dent stays below while the material passes through it: in axes of
the body it runs around, and needs modes everywhere on its way. In axes that do not turn, few patterns psi are enough. A
body that has turned by the angle a about a fixed axis has the coefficients

    c(a) = M(a) s,   M_kj(a) = <phi_k(x), R(a)^T psi_j(R(a) x)>,

of its modes phi: the mean product over the body's mass. M has the period 2 pi, and is kept as a Fourier series.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from odeform.types import Arrays, Floats, Vector

__all__ = ["Rolling", "fourier_series"]

PREFIX = "rolling."
RIDGE = 1e-9  # relative; against patterns that the body's modes do not know
CHUNK = 256  # times at once


@dataclass(frozen=True, eq=False)
class Rolling:
    """M(a) of K modes and S patterns."""

    axis: Vector
    """(3,) unit vector in canonical axes, about which the body turns."""
    harmonics: Float[np.ndarray, "terms modes patterns"]
    """The constant, then cosines of 1 to H times the angle, then sines."""

    @property
    def patterns(self) -> int:
        """S, the number of patterns."""
        return self.harmonics.shape[2]

    def first(self, count: int) -> "Rolling":
        """Keeps the first `count` patterns."""
        return replace(self, harmonics=self.harmonics[..., :count])

    def angles(self, vectors: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch"]:
        """Computes (...) angles in radians of rotation vectors (..., 3)."""
        return vectors @ self.axis

    def matrices(self, angles: Float[np.ndarray, " times"]) -> Float[np.ndarray, "times modes patterns"]:
        """Returns M at angles (T,)."""
        phases = np.outer(angles, np.arange(1, len(self.harmonics) // 2 + 1))
        terms = np.concatenate([np.ones((len(angles), 1)), np.cos(phases), np.sin(phases)], axis=1)
        flat = self.harmonics.reshape(len(self.harmonics), -1)
        return (terms @ flat).reshape(len(angles), *self.harmonics.shape[1:])

    def coefficients(
        self, vectors: Float[np.ndarray, "times 3"], patterns: Float[np.ndarray, "times patterns"]
    ) -> Float[np.ndarray, "times modes"]:
        """Computes (T, K) of the modes, under rotation vectors (T, 3) and amplitudes (T, S) of the patterns."""
        return np.einsum("tkj,tj->tk", self.matrices(self.angles(vectors)), patterns)

    def amplitudes(
        self, vectors: Float[np.ndarray, "times 3"], coefficients: Float[np.ndarray, "times modes"]
    ) -> Float[np.ndarray, "times patterns"]:
        """(T, S) of the patterns, by which coefficients (T, K) of the modes are met best."""
        out = np.empty((len(vectors), self.patterns))
        for at in range(0, len(out), CHUNK):
            matrices = self.matrices(self.angles(vectors[at : at + CHUNK]))
            normal = matrices.swapaxes(1, 2) @ matrices
            normal += RIDGE * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(self.patterns)
            known = np.einsum("tkj,tk->tj", matrices, coefficients[at : at + CHUNK])
            out[at : at + CHUNK] = np.linalg.solve(normal, known[..., None])[..., 0]
        return out

    def arrays(self) -> Arrays:
        """The arrays of a checkpoint, by name; `from_arrays` reads them."""
        return {f"{PREFIX}axis": self.axis, f"{PREFIX}harmonics": self.harmonics.astype(np.float32)}

    @classmethod
    def from_arrays(cls, arrays: Arrays, modes: int) -> "Rolling | None":
        """None for a checkpoint without. ValueError unless arrays are finite and of `modes`."""
        if f"{PREFIX}axis" not in arrays:
            return None
        axis, harmonics = (arrays[PREFIX + name].astype(float) for name in ("axis", "harmonics"))
        if axis.shape != (3,) or not abs(np.linalg.norm(axis) - 1.0) < 1e-6:
            raise ValueError(f"{PREFIX}axis: expected a unit vector, got {axis}")
        odd = harmonics.ndim == 3 and len(harmonics) % 2 == 1
        if not odd or harmonics.shape[1] != modes or not harmonics.shape[2] or not np.isfinite(harmonics).all():
            raise ValueError(
                f"{PREFIX}harmonics: expected a finite array of {modes} modes and an odd number of terms, "
                f"got shape {harmonics.shape}"
            )
        return cls(axis, harmonics)


def fourier_series(values: Float[np.ndarray, "angles modes patterns"], tolerance: float) -> Floats:
    """(2 H + 1, K, S): the terms of a function of the period 2 pi, from its values at an even number of even angles
    from 0 on, with the fewest harmonics H that leave out at most `tolerance` of its root mean square."""
    terms = np.fft.rfft(values, axis=0) / len(values)
    terms[1:] *= 2.0
    power = np.square(np.abs(terms)).reshape(len(terms), -1).sum(axis=1)
    left_out = np.append(np.cumsum(power[::-1])[::-1][1:], 0.0)
    count = int(np.argmax(left_out <= tolerance**2 * power.sum()))
    return np.concatenate([terms[:1].real, terms[1 : count + 1].real, -terms[1 : count + 1].imag])
