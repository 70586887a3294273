"""What a shown body lies on: the floor, and obstacles."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from odeform.loads.obstacle import Obstacle
from odeform.types import Frames, Points, Pose

__all__ = ["Ground"]

Sides = Int[np.ndarray, "sides 2"]


@dataclass(frozen=True, eq=False)
class Ground:
    """Springs of contacts stand for what gives way there: points that would be inside of something lie on it."""

    floor: float
    """m: the height below which there is none of a body."""
    obstacles: tuple[Obstacle, ...] = ()

    def keep_out(self, points: Frames, sides: Sides) -> None:
        """Move those of the points (T, N, 3) m that are inside of something onto it, and both ends of `sides` of faces
        that an edge of it cuts."""
        np.maximum(points[..., 2], points.dtype.type(self.floor), out=points[..., 2])
        self._keep_off(points, sides)

    def _keep_off(self, points: Frames, sides: Sides) -> None:
        for obstacle in self.obstacles:
            obstacle.keep_out(points)
            obstacle.keep_sides_out(points, sides)

    def keep_posed_out(self, points: Points, local: Frames, poses: Pose, sides: Sides) -> None:
        """Change displacements (T, N, 3) m of points (N, 3) m so that `poses` (T, 4, 4) move none into something; see
        `keep_out`."""
        poses = poses.astype(np.float32)
        upwards = poses[:, None, 2, :3]
        heights = ((points + local) * upwards).sum(axis=-1) + poses[:, 2, 3, None]
        local += np.maximum(np.float32(self.floor) - heights, 0.0)[..., None] * upwards
        if self.obstacles:
            turns = poses[:, :3, :3]
            placed = (points + local) @ turns.swapaxes(1, 2) + poses[:, None, :3, 3]
            out = placed.copy()
            self._keep_off(out, sides)
            local += (out - placed) @ turns
