"""A rigid box that a body meets besides the floor: a wall, a step, a slope."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float, Int

from odeform.types import Floats, Frames, Mesh, Rotations, Vector

__all__ = ["Obstacle", "half_space"]

FAR = np.full(3, np.inf)
SWEEPS, PARTS = 4, 9  # times that sides are moved off an edge; places along each of them that are looked at
TOUCHES = 1e-5  # m
CORNERS = np.array([[i, j, k] for k in (0, 1) for j in (0, 1) for i in (0, 1)])
FACES = np.array(
    [
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ],
    dtype=np.int32,
)  # of a box with these corners, outward


@dataclass(frozen=True, eq=False)
class Obstacle:
    """A box from `low` to `high` in its own axes. Sides may be infinitely far: a half space has one that is not.

    It does not move, and is as rough and as stiff as the floor.
    """

    place: Vector
    """(3,) m: the origin of its axes."""
    low: Vector
    """(3,) m"""
    high: Vector
    """(3,) m"""
    shown: tuple[Vector, Vector]
    """(3,) m: the lowest and the highest corner of what is drawn of it."""
    turn: Rotations = field(default_factory=lambda: np.eye(3))
    """(3, 3), of which the columns are its axes."""
    name: str = "obstacle"
    """What people call it."""

    def met(self, points: Float[np.ndarray, "*points 3"]) -> tuple[Floats, Floats]:
        """Signed distances (...,) m of points (..., 3) m, negative inside, and the outward normals (..., 3) there."""
        local = (points - self.place) @ self.turn
        below, above = self.low - local, local - self.high
        beyond, side = np.maximum(below, above), np.where(above >= below, 1.0, -1.0)
        outside = np.maximum(beyond, 0.0)
        away, nearest = np.sqrt((outside * outside).sum(axis=-1)), beyond.argmax(axis=-1)
        deepest = beyond.max(axis=-1)
        free = (deepest > 0.0)[..., None]
        normal = np.where(free, outside / np.where(free, away[..., None], 1.0), np.eye(3)[nearest]) * side
        return np.where(free[..., 0], away, deepest), normal @ self.turn.T

    def keep_out(self, points: Float[np.ndarray, "*points 3"]) -> None:
        """Move those of the points (..., 3) m that are inside to the nearest place on its surface."""
        gap, normal = self.met(points)
        inside = gap < 0.0
        points[inside] -= (gap[inside, None] * normal[inside]).astype(points.dtype)

    def keep_sides_out(self, points: Frames, sides: Int[np.ndarray, "sides 2"]) -> None:
        """Move points (T, N, 3) m, none of which is inside, so that no edge of the box cuts one of the `sides` between
        two of them: both ends go with the deepest place of a side to the nearest edge."""
        if not len(sides):
            return
        for _ in range(SWEEPS):
            local = (points - self.place) @ self.turn
            # a side is not cut if both of its ends are beyond the same plane
            beyond = np.concatenate([local <= self.low + TOUCHES, local >= self.high - TOUCHES], axis=-1)
            planes = np.packbits(beyond, axis=-1)[..., 0]
            near = np.flatnonzero(np.bitwise_and.reduce(planes, axis=1) == 0)
            row, which = np.nonzero((planes[near][:, sides[:, 0]] & planes[near][:, sides[:, 1]]) == 0)
            frame, one, other = near[row], sides[which, 0], sides[which, 1]
            moves, cut = self._off_edges(local[frame, one], local[frame, other])
            if not cut.any():
                return
            moves, frame, least, most = moves[cut], frame[cut], np.zeros(local.shape), np.zeros(local.shape)
            for end in (one[cut], other[cut]):
                np.minimum.at(least, (frame, end), moves)
                np.maximum.at(most, (frame, end), moves)
            points += ((least + most) @ self.turn.T).astype(points.dtype)

    def _off_edges(
        self, one: Float[np.ndarray, "sides 3"], other: Float[np.ndarray, "sides 3"]
    ) -> tuple[Float[np.ndarray, "sides 3"], Bool[np.ndarray, " sides"]]:
        """How far to move sides (S, 3) m in its own axes from where they are deepest to the nearest edge, and which of
        them are cut."""
        places = one[:, None] + np.linspace(0.0, 1.0, PARTS)[:, None] * (other - one)[:, None]
        below, above = places - self.low, self.high - places
        away = np.minimum(below, above)
        deepest = away.min(axis=2).argmax(axis=1)
        rows = np.arange(len(one))
        away = away[rows, deepest]
        out = np.where((above < below)[rows, deepest], away, -away)
        # an edge is where two planes meet: along it, the farthest of the three, nothing moves
        out[rows, away.argmax(axis=1)] = 0.0
        return out, away.min(axis=1) > TOUCHES

    @property
    def mesh(self) -> Mesh:
        """What is drawn of it, m."""
        low, high = self.shown
        corners = low + CORNERS * (high - low)
        return Mesh((self.place + corners @ self.turn.T).astype(np.float32), FACES)


def half_space(
    place: Vector, normal: Vector, wide: tuple[float, float], long: tuple[float, float], name: str = "obstacle"
) -> Obstacle:
    """Everything behind the plane through `place` (3,) m whose outward `normal` (3,) has no part along y.

    Drawn is a plate of it: from and to, in m along y, and in m along the plane across y.
    """
    along = np.cross([0.0, 1.0, 0.0], normal)
    turn = np.stack([along, [0.0, 1.0, 0.0], normal], axis=1)
    plate = np.array([long[0], wide[0], -THICK]), np.array([long[1], wide[1], 0.0])
    return Obstacle(np.asarray(place, dtype=float), -FAR, np.array([np.inf, np.inf, 0.0]), plate, turn, name)


THICK = 0.02  # m, of the plate that is drawn of a half space
