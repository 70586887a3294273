"""Keeps the tetrahedra of a simulated body from turning inside out.

Saint Venant-Kirchhoff material gives way under strong compression, and is at rest inside out as well: a tetrahedron
that an impact flattens may pass through itself, and then stays so for good.
"""

from typing import Any

import numpy as np

from odeform.simulation.objects.body import SoftBody
from odeform.types import Floats, Ints, Points

__all__ = ["GuardedBody"]

SMALLEST = 0.1  # of its volume without stress: what a tetrahedron is kept above
SWEEPS = 10  # in each step; neighbours push each other back
SLACK = 1.02


class GuardedBody:
    """A flexible body of tetrahedra. It is a `odeform.simulation.stepping.Body`.

    After each step, tetrahedra of less than a tenth of their volume are given that much again: their nodes are moved
    along the gradients of the volume, by the inverse of their masses (Mueller et al. 2007, Position Based Dynamics).
    That moves no mass centre. Where none is that small, nothing changes.
    """

    def __init__(self, body: SoftBody, points: Points, elements: Ints) -> None:
        """`points` (N, 3) m are the nodes without stress, `elements` (M, 4)."""
        self._body, self._elements = body, elements
        volumes, _ = _volumes(points[elements])
        self._signs, self._least = np.sign(volumes), SMALLEST * np.abs(volumes)
        self._yields = 1.0 / body.masses

    @property
    def model(self) -> Any:
        """The simulator's model."""
        return self._body.model

    @property
    def data(self) -> Any:
        """The simulator's state."""
        return self._body.data

    @property
    def timestep(self) -> float:
        """The step of the simulation, s."""
        return self._body.timestep

    @property
    def weights(self) -> Floats:
        """(N,) mass fraction at each vertex."""
        return self._body.weights

    @property
    def positions(self) -> Floats:
        """(N, 3) metres."""
        return self._body.positions

    @positions.setter
    def positions(self, value: Floats) -> None:
        self._body.positions = value

    @property
    def velocities(self) -> Floats:
        """(N, 3) m/s, a view."""
        return self._body.velocities

    def set_timestep(self, step: float) -> None:
        """Go on in steps of `step` seconds."""
        self._body.set_timestep(step)

    def check(self) -> None:
        """Raise `SimulationError` unless the run so far is sound."""
        self._body.check()

    def step(self, force: Floats | None = None) -> None:
        """Advance by one time step under `force` (N, 3) in newton at the vertices."""
        self._body.step(force)
        before = positions = self._body.positions
        for _ in range(SWEEPS):
            corners = positions[self._elements]
            volumes, sides = _volumes(corners)
            missing = self._least - self._signs * volumes
            flat = np.flatnonzero(missing > 0.0)
            if not len(flat):
                break
            positions = positions + self._moves(flat, missing[flat], sides[flat])
        if positions is not before:
            self._body.positions = positions

    def _moves(self, flat: Ints, missing: Floats, sides: Floats) -> Points:
        """(N, 3) m by which nodes move to give the tetrahedra `flat` (F,) the volumes (F,) that they miss, m^3."""
        a, b, c = sides.transpose(1, 0, 2)
        gradients = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
        gradients = self._signs[flat, None, None] / 6.0 * gradients
        gradients = np.concatenate([-gradients.sum(axis=1, keepdims=True), gradients], axis=1)
        nodes = self._elements[flat]
        directions = self._yields[nodes][..., None] * gradients
        # a node of several of them is not moved by all at once
        amounts = (
            SLACK * missing / (directions * gradients).sum(axis=(1, 2)) / np.bincount(nodes.ravel())[nodes].max(axis=1)
        )
        moves = np.zeros((len(self._yields), 3))
        np.add.at(moves, nodes, amounts[:, None, None] * directions)
        return moves


def _volumes(corners: Floats) -> tuple[Floats, Floats]:
    """(M,) m^3 with their signs, and the sides (M, 3, 3) from the first corner, of corners (M, 4, 3) m."""
    sides = corners[:, 1:] - corners[:, :1]
    return np.einsum("mi,mi->m", sides[:, 0], np.cross(sides[:, 1], sides[:, 2])) / 6.0, sides
