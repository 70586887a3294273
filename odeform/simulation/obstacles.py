"""Obstacles of `odeform.loads` as geoms of the simulator."""

from collections.abc import Sequence

import numpy as np

from odeform.loads.obstacle import Obstacle
from odeform.simulation.flex import CONTACT_RADIUS, Contact
from odeform.types import Floats

__all__ = ["obstacle_xml"]

BELOW = 0.1  # m of a box that reaches down without an end, below what is drawn of it


def obstacle_xml(obstacles: Sequence[Obstacle], contact: Contact) -> str:
    """The XML of geoms that bodies meet as they meet the floor: the skin of their contacts outside the obstacles.

    `ValueError` for an obstacle with infinite sides that is not a half space along its z axis.
    """
    return "".join(f"<geom {_shape(obstacle)} {contact.xml}/>" for obstacle in obstacles)


def _shape(obstacle: Obstacle) -> str:
    low, high = obstacle.low + CONTACT_RADIUS, obstacle.high - CONTACT_RADIUS
    if np.isfinite([*low[:2], *high]).all():
        low[2] = max(low[2], obstacle.shown[0][2] - BELOW + CONTACT_RADIUS)
        middle = obstacle.place + obstacle.turn @ (0.5 * (low + high))
        axes = f'xyaxes="{_text(obstacle.turn[:, 0])} {_text(obstacle.turn[:, 1])}"'
        return f'type="box" size="{_text(0.5 * (high - low))}" pos="{_text(middle)}" {axes}'
    if np.isfinite(high[2]) and not np.isfinite([*low, *high[:2]]).any():
        middle = obstacle.place + high[2] * obstacle.turn[:, 2]
        return f'type="plane" size="0 0 1" pos="{_text(middle)}" zaxis="{_text(obstacle.turn[:, 2])}"'
    raise ValueError(f"expected a box or a half space, got sides at {obstacle.low} and {obstacle.high}")


def _text(vector: Floats) -> str:
    return " ".join(f"{x:.17g}" for x in vector)
