"""Real spherical harmonics, which give splats a colour that depends on the viewing direction.

Coefficient l (l + 1) + m belongs to degree l, order m = -l ... l, with the signs of Kerbl et al., "3D Gaussian
Splatting for Real-Time Radiance Field Rendering" (2023): orthonormal, with the Condon-Shortley phase (-1)^m.
"""

from math import factorial, isqrt, pi, prod, sqrt

import numpy as np
from jaxtyping import Float

from odeform.types import Harmonics, Rotations, Vectors

__all__ = ["harmonic_basis", "rotated_harmonics"]

BLOCK = 4096  # splats at a time: intermediate values fit the cache
DIRECTIONS = 10  # in which a harmonic is sampled; degree 3 has 7 coefficients


def harmonic_basis(directions: Vectors, degree: int) -> Float[np.ndarray, "*batch basis"]:
    """Maps (..., 3) unit vectors to (..., (degree + 1)^2) values, by the recurrences of Legendre functions."""
    x, y, z = np.moveaxis(np.asarray(directions, dtype=float), -1, 0)
    out = np.empty((*x.shape, (degree + 1) ** 2))
    real, imaginary = np.ones_like(x), np.zeros_like(x)  # (x + i y)^m
    for m in range(degree + 1):
        # without the factor sin(theta)^m, which (x + i y)^m contains
        below, here = np.zeros_like(z), np.full_like(z, (-1.0) ** m * prod(range(1, 2 * m, 2)))
        for n in range(m, degree + 1):
            size = sqrt((2.0 if m else 1.0) * (2 * n + 1) / (4 * pi) * factorial(n - m) / factorial(n + m))
            out[..., n * (n + 1) + m] = size * here * real
            if m:
                out[..., n * (n + 1) - m] = size * here * imaginary
            below, here = here, ((2 * n + 1) * z * here - (n + m) * below) / (n + 1 - m)
        real, imaginary = real * x - imaginary * y, real * y + imaginary * x
    return out


def rotated_harmonics(harmonics: Harmonics, rotations: Rotations) -> Harmonics:
    """Rotate (N, H, 3) coefficients by (3, 3) or (N, 3, 3): the colour from direction R d is that from d before.

    Rotation does not mix degrees, so the rotated coefficients of a degree follow from its values in a fixed set of
    directions d: B c' = B(R^-1 d) c, solved with the pseudo-inverse of B.
    """
    degree = isqrt(harmonics.shape[1]) - 1
    if degree == 0:
        return harmonics
    directions = _hemisphere(DIRECTIONS)
    inverses = [np.linalg.pinv(harmonic_basis(directions, degree)[:, _coefficients(n)]) for n in range(degree + 1)]
    out = harmonics.copy()
    for start in range(0, len(harmonics), BLOCK):
        block = slice(start, start + BLOCK)
        values = harmonic_basis(directions @ (rotations if rotations.ndim == 2 else rotations[block]), degree)
        for n in range(1, degree + 1):
            columns = _coefficients(n)
            out[block, columns] = inverses[n] @ values[..., columns] @ harmonics[block, columns]
    return out


def _coefficients(degree: int) -> slice:
    """The columns of one degree."""
    return slice(degree**2, (degree + 1) ** 2)


def _hemisphere(count: int) -> Vectors:
    """(K, 3) evenly spread directions (a Fibonacci spiral); the other half of the sphere is redundant by parity."""
    index = np.arange(count)
    z, angle = (index + 0.5) / count, index * pi * (3.0 - sqrt(5.0))
    flat = np.sqrt(1.0 - z**2)
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), z], axis=1)
