"""Obstacles of a batch of bodies, as arrays: each motion has its own, and all have as many."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.loads.obstacle import Obstacle
from odeform.types import Floats, Ints, Vector

__all__ = ["Obstacles"]


@dataclass(frozen=True, eq=False)
class Obstacles:
    """The obstacles of B motions, O in each."""

    packed: Float[np.ndarray, "batch obstacles 6 3"]
    """For each: where it is in m, from where the mass centre rests, its three axes, and its extents in m along them."""

    @classmethod
    def of(cls, each: Sequence[tuple[Obstacle, ...]], anchor: Vector) -> "Obstacles | None":
        """The obstacles of several motions of a body whose mass centre rests at `anchor` (3,) m; None without any."""
        if not each[0]:
            return None
        rows = [
            [np.stack([one.place - anchor, *one.turn.T, one.low, one.high]) for one in obstacles] for obstacles in each
        ]
        return cls(np.array(rows))

    def some(self, rows: Ints) -> "Obstacles":
        """Those of the motions `rows` (R,)."""
        return Obstacles(self.packed[rows])

    @property
    def each(self) -> "tuple[Obstacles, ...]":
        """One after the other, of all motions."""
        return tuple(Obstacles(self.packed[:, index : index + 1]) for index in range(self.packed.shape[1]))

    def met(self, points: Float[np.ndarray, "batch samples 3"]) -> tuple[Floats, Floats]:
        """Signed distances (B, S) m from the first obstacle, and normals (B, S, 3); see
        `odeform.loads.obstacle.Obstacle.met`."""
        gaps, normals = np.empty(points.shape[:2]), np.empty(points.shape)
        for row, some, gap, normal in zip(self.packed[:, 0], points, gaps, normals, strict=True):
            one = Obstacle(row[0], row[4], row[5], (row[4], row[5]), row[1:4].T)
            gap[:], normal[:] = one.met(some)
        return gaps, normals
