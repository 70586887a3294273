"""Gaussian splats in few bytes: 16-bit centres, 8-bit sizes, rotations, colours and harmonics."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int8, UInt8, UInt16

from odeform.geometry.ellipsoids import axes_from_covariances, covariances_from_axes
from odeform.types import SH0, Arrays, Floats, GaussianSplats, Ints

__all__ = ["PackedSplats", "packed", "splat_bytes"]

THINNEST = 1e-6  # m, one standard deviation
PLAIN = 17  # bytes of a splat without further harmonics


@dataclass(frozen=True, eq=False)
class PackedSplats:
    """N splats as the page holds them; rotations are quaternions with w first."""

    centers: UInt16[np.ndarray, "splats 3"]
    sizes: UInt8[np.ndarray, "splats 3"]
    """Logarithms of standard deviations."""
    turns: Int8[np.ndarray, "splats 4"]
    colors: UInt8[np.ndarray, "splats 4"]
    """Red, green and blue without further harmonics; opacity."""
    harmonics: Int8[np.ndarray, "splats further 3"]
    low: Floats
    """(5,): of centres (3) in m, of logarithms of sizes in m, and of red, green and blue."""
    steps: Floats
    """(5,): likewise."""
    harmonic_steps: Float[np.ndarray, " further"]

    @cached_property
    def splats(self) -> GaussianSplats:
        """What the page draws at rest."""
        low, steps = self.low, self.steps
        points = low[:3] + steps[:3] * self.centers
        covariances = covariances_from_axes(np.exp(low[3] + steps[3] * self.sizes), self.turns.astype(float))
        constant = (low[4] + steps[4] * self.colors[:, :3] - 0.5) / SH0
        further = self.harmonics * self.harmonic_steps[:, None]
        harmonics = np.concatenate([constant[:, None], further], axis=1).astype(np.float32)
        return GaussianSplats(points.astype(np.float32), covariances, harmonics, self.colors[:, 3] / 255.0)

    def arrays(self) -> Arrays:
        """What the page holds of them, by name."""
        floats = {"low": self.low, "steps": self.steps, "harmonic_steps": self.harmonic_steps}
        whole = {name: getattr(self, name) for name in ("centers", "sizes", "turns", "colors", "harmonics")}
        return whole | {name: array.astype(np.float32) for name, array in floats.items()}


def splat_bytes(degree: int) -> int:
    """How many bytes a splat with harmonics up to `degree` takes."""
    return PLAIN + 3 * ((degree + 1) ** 2 - 1)


def packed(splats: GaussianSplats, degree: int, kept: Ints) -> PackedSplats:
    """Packs the splats `kept` (S,), at least one, with harmonics up to `degree` at most."""
    points = np.asarray(splats.points[kept], dtype=float)
    sizes, turns = axes_from_covariances(splats.covariances[kept])
    logs = np.log(np.maximum(sizes, THINNEST))
    colors = 0.5 + SH0 * splats.harmonics[kept, 0].astype(float)
    further = splats.harmonics[kept, 1 : (degree + 1) ** 2].astype(float)
    low = np.array([*points.min(axis=0), logs.min(initial=0.0), colors.min(initial=0.0)])
    high = np.array([*points.max(axis=0), logs.max(initial=-20.0), colors.max(initial=1.0)])
    full = np.array([65535.0] * 3 + [255.0] * 2)
    steps = np.maximum(high - low, 1e-12) / full
    harmonic_steps = np.maximum(np.abs(further).max(axis=(0, 2), initial=0.0), 1e-12) / 127.0
    opaque = np.clip(splats.opacities[kept, None], 0.0, 1.0)
    return PackedSplats(
        np.rint((points - low[:3]) / steps[:3]).astype(np.uint16),
        np.rint((logs - low[3]) / steps[3]).astype(np.uint8),
        np.rint(127.0 * turns).astype(np.int8),
        np.concatenate([np.rint((colors - low[4]) / steps[4]), np.rint(255.0 * opaque)], axis=1).astype(np.uint8),
        np.rint(further / harmonic_steps[:, None]).astype(np.int8),
        low,
        steps,
        harmonic_steps,
    )
