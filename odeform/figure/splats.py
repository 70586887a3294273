"""Gaussian splats of a figure: those of the body, bound to nodes that the page moves, and those that stand still."""

from dataclasses import dataclass, replace
from math import isqrt

import numpy as np
from jaxtyping import Float

from odeform.figure.binding import Binding, bound
from odeform.figure.packed_splats import PackedSplats, packed, splat_bytes
from odeform.geometry.harmonics import rotated_harmonics
from odeform.geometry.rigid import rotation_z
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.reduced_motion import ReducedMotion
from odeform.types import Arrays, Floats, GaussianSplats, Ints

__all__ = ["FigureSplats", "figure_splats"]

HIGHEST = 3  # degree of harmonics
BOUND_BYTES = 16  # of a splat that moves, for its nodes and weights
MEASURED = 2000  # splats of which errors are measured
STRIPPED = ((3, 3), (3, 2), (3, 1), (3, 0), (2, 0), (1, 0), (0, 0))
"""Highest degrees of the harmonics of what moves and of what stands still: the first of which all splats fit."""


@dataclass(frozen=True, eq=False)
class FigureSplats:
    """What of the splats of a body, and of the scene around it, a page holds."""

    body: GaussianSplats
    """All of them at rest, canonical."""
    scene: GaussianSplats | None
    """All that stand still, where they lie in the scene."""
    kept: Ints
    """Those of the body that are shown."""
    kept_still: Ints
    """Those of the scene."""
    binding: Binding
    """Of those that are kept."""
    moving: PackedSplats
    still: PackedSplats | None
    apart_mm: tuple[float, float]
    """RMS and largest distance of centres from where the model has them at the same coordinates, over its motion in the
    middle of the sliders."""

    @property
    def degrees(self) -> tuple[int, int]:
        """Highest degree of the harmonics of what moves, and of what stands still."""
        moving, still = (0 if p is None else isqrt(p.harmonics.shape[1] + 1) - 1 for p in (self.moving, self.still))
        return moving, still

    @property
    def given_degree(self) -> int:
        """Highest degree of the harmonics of the file."""
        return isqrt(self.body.harmonics.shape[1]) - 1

    @property
    def shown(self) -> tuple[int, int]:
        """How many splats are shown, and how many there are."""
        return len(self.kept) + len(self.kept_still), len(self.body.points) + _count(self.scene)

    def within(self, most_bytes: int) -> "FigureSplats":
        """Keeps what fits into so many bytes: first harmonics of a high degree go, of what stands still before what
        moves, then splats, evenly in their order; those that stay are larger for it and cover as much."""
        degrees = next((degrees for degrees in STRIPPED if self._bytes(degrees) <= most_bytes), STRIPPED[-1])
        fraction = min(most_bytes / self._bytes(degrees), 1.0)
        kept, kept_still = _even(self.body, fraction), _even(self.scene, fraction)
        return replace(
            self,
            kept=kept,
            kept_still=kept_still,
            binding=self.binding.of(kept),
            moving=packed(_larger(self.body, kept), degrees[0], kept),
            still=None if self.scene is None else packed(_larger(self.scene, kept_still), degrees[1], kept_still),
        )

    def _bytes(self, degrees: tuple[int, int]) -> int:
        """Of all splats with harmonics up to these degrees."""
        moving, still = (splat_bytes(min(degree, self.given_degree)) for degree in degrees)
        return len(self.body.points) * (moving + BOUND_BYTES) + _count(self.scene) * still

    def sampled(self) -> "FigureSplats":
        """Some of those that move, of which errors are measured."""
        if len(self.kept) <= MEASURED:
            return self
        some = np.sort(np.random.default_rng(0).choice(len(self.kept), MEASURED, replace=False))
        degree = self.degrees[0]
        kept = self.kept[some]
        return replace(self, kept=kept, binding=self.binding.of(some), moving=packed(self.body, degree, kept))

    def local(self, moved: Float[np.ndarray, "times nodes 3"]) -> Floats:
        """Computes centres (T, M, 3) m before the pose from displacements of the nodes."""
        return self.moving.splats.points + self.binding.carried(moved)

    def arrays(self) -> Arrays:
        """What the page holds of them, by name."""
        parts = {"moving": self.moving, "still": self.still}
        packs = {f"{k}_{name}": array for k, p in parts.items() if p for name, array in p.arrays().items()}
        return self.binding.arrays() | packs


def figure_splats(motion: ReducedMotion, still: GaussianSplats | None) -> FigureSplats:
    """All splats of a motion's geometry, and of what stands `still` in the scene."""
    body, coefficients = motion.geometry, motion.coordinates(motion.schema.window.times)[:, 6:]
    assert isinstance(body, GaussianSplats)
    evaluated = motion.evaluated
    binding = bound(evaluated, np.sqrt(np.square(coefficients).mean(axis=0)))
    turn = rotation_z(evaluated.azimuth).T
    canonical = GaussianSplats(
        evaluated.rest,
        turn @ body.covariances @ turn.T,
        rotated_harmonics(_of_degree(body), turn),
        body.opacities,
    )
    if still is not None:
        still = replace(still, harmonics=_of_degree(still)) if len(still.points) else None
    every, others = np.arange(len(evaluated.rest)), np.arange(_count(still))
    moving = packed(canonical, HIGHEST, every)
    unmoved = None if still is None else packed(still, HIGHEST, others)
    apart = _apart(binding, evaluated, coefficients)
    return FigureSplats(canonical, still, every, others, binding, moving, unmoved, apart)


def _count(splats: GaussianSplats | None) -> int:
    return 0 if splats is None else len(splats.points)


def _of_degree(splats: GaussianSplats) -> Float[np.ndarray, "points harmonics 3"]:
    return splats.harmonics[:, : (HIGHEST + 1) ** 2]


def _even(splats: GaussianSplats | None, fraction: float) -> Ints:
    """So many of the splats, evenly in their order."""
    total = _count(splats)
    return np.linspace(0, total - 1, max(int(fraction * total), 1)).astype(int) if total else np.arange(0)


def _larger(splats: GaussianSplats, kept: Ints) -> GaussianSplats:
    """All of them as large as those that are kept have to be to cover the same area."""
    return replace(splats, covariances=splats.covariances * (len(splats.points) / len(kept)))


def _apart(
    binding: Binding, evaluated: EvaluatedBasis, coefficients: Float[np.ndarray, "times modes"]
) -> tuple[float, float]:
    """RMS and largest distance in mm between displacements that nodes carry and those of the basis."""
    rows = np.random.default_rng(0).permutation(len(evaluated.rest))[:MEASURED]
    modes = evaluated.values.reshape(coefficients.shape[1], -1, 3)
    nodes, points = (
        np.tensordot(coefficients.astype(np.float32), modes[:, some], axes=1) for some in (binding.nodes, rows)
    )
    square = np.square(binding.of(rows).carried(nodes) - points).sum(axis=2)
    return 1e3 * float(np.sqrt(square.mean())), 1e3 * float(np.sqrt(square.max(initial=0.0)))
