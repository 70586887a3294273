"""Describes how the motion of a body begins and what acts on it: mechanics and simulator take the same description."""

from dataclasses import dataclass, field

import numpy as np

from odeform.errors import InputError
from odeform.geometry.contact import SurfacePoint
from odeform.loads.obstacle import Obstacle
from odeform.surroundings import GRAVITY
from odeform.types import Floats, Mesh, Perpoint, Points, Rotations, Vector

__all__ = [
    "Clamp",
    "Flight",
    "Pulse",
    "Situation",
    "Twin",
    "beginning_outside",
    "patch_weights",
    "pulse_strength",
]

TOUCH = 2e-3  # m that a body may begin inside an obstacle: how it gives way under its weight is not looked at


@dataclass(frozen=True, eq=False)
class Flight:
    """A body that begins in the air, without stress and as a rigid body."""

    height: float
    """m, of its lowest point above the floor."""
    rotation: Rotations = field(default_factory=lambda: np.eye(3))
    """(3, 3), from how it rests on the floor."""
    velocity: Vector = field(default_factory=lambda: np.zeros(3))
    """(3,) m/s, of its mass centre."""
    spin: Vector = field(default_factory=lambda: np.zeros(3))
    """(3,) rad/s."""

    def placed(self, rest: Points) -> Points:
        """About where points (N, 3) m of a body that rests on the floor begin: what it gives way under its weight
        aside."""
        turned = (rest - rest.mean(axis=0, dtype=float)) @ self.rotation.T
        return turned + np.array([0.0, 0.0, self.height - turned[:, 2].min()])


@dataclass(frozen=True, eq=False)
class Pulse:
    """A force on a patch of the surface, which rises and falls as sin^2 of the time, from time 0 on."""

    place: SurfacePoint
    """Its middle, on the body where it rests."""
    force: Vector
    """(3,) N at its peak. It keeps its direction when the body turns."""
    duration: float
    """s"""
    radius: float
    """m: the force on a point falls with its distance from the middle as a Gaussian of this width."""

    def weights(self, points: Points, masses: Perpoint, middle: Vector) -> Perpoint:
        """Computes (N,) the fractions of the force on points (N, 3) m that stand for `masses` (N,) kg, around `middle`
        (3,) m; they sum to 1."""
        return patch_weights(points, masses, middle, self.radius)


@dataclass(frozen=True, eq=False)
class Clamp:
    """Springs and dampers, both ways, that hold a patch of the surface where its points begin."""

    vertex: int
    """The vertex of the surface in the middle of the patch."""
    radius: float
    """m: the stiffness falls with the distance from the middle as a Gaussian of this width."""
    sink: float
    """m by which the whole weight of the body would displace a patch that does not turn."""
    damping: float
    """s: of the dampers, relative to the springs."""

    def stiffness(self, points: Points, masses: Perpoint, mass: float) -> Perpoint:
        """Computes (N,) N/m of each axis at vertices (N, 3) m of a body at rest, which stand for `masses` (N,) kg.

        That of all is what carries a body of `mass` kg.
        """
        weights = patch_weights(points, masses, points[self.vertex], self.radius)
        return mass * GRAVITY / self.sink * weights


@dataclass(frozen=True, eq=False)
class Twin:
    """A second body like the first one, which stands on the floor at rest."""

    place: Vector
    """(3,) m along the floor: where its mass centre is, from where that of the first one begins."""
    turn: Rotations = field(default_factory=lambda: np.eye(3))
    """(3, 3), about the vertical, from how the first one rests on the floor."""

    def placed(self, rest: Points, centre: Vector) -> Points:
        """Where points (N, 3) m of a body are that rests on the floor with its mass centre at `centre` (3,) m."""
        level = centre * [1.0, 1.0, 0.0]
        return (rest - level) @ self.turn.T + self.place


@dataclass(frozen=True, eq=False)
class Situation:
    """How a motion begins, and what acts on the body besides its weight and the floor."""

    flight: Flight | None = None
    """None for a body that begins at rest on the floor."""
    pulse: Pulse | None = None
    clamp: Clamp | None = None
    obstacles: tuple[Obstacle, ...] = ()
    """What the body meets besides the floor. All situations of a load have as many."""
    twin: Twin | None = None
    """What it is thrown at."""


def beginning_outside(rest: Mesh, flight: Flight, obstacles: tuple[Obstacle, ...], name: str) -> Situation:
    """A flight towards obstacles; `InputError` for a body that would begin inside one of them."""
    points = flight.placed(rest.points)
    inside = max(-float(obstacle.met(points)[0].min()) for obstacle in obstacles)
    if inside > TOUCH:
        raise InputError(f"distance: expected a body that begins outside the {name}, got {inside:.2g} m inside it")
    return Situation(flight, obstacles=obstacles)


def patch_weights(points: Points, masses: Perpoint, middle: Vector, radius: float) -> Perpoint:
    """Computes (N,) shares of points (N, 3) m that stand for `masses` (N,), in a patch around `middle` (3,) m whose
    weight falls as a Gaussian of `radius` m; they sum to 1."""
    away = ((points - middle) ** 2).sum(axis=1)
    # relative to the nearest one, which has a share however far away it is
    weights = masses * np.exp((away.min() - away) / radius**2)
    return weights / weights.sum()


def pulse_strength(time: float | Floats, duration: float) -> Floats:
    """Computes () or (T,) the fraction of its peak, sin^2(pi t / duration), of a pulse from 0 to `duration` s."""
    inside = np.clip(np.asarray(time, dtype=float), 0.0, duration)
    return np.asarray(np.sin(np.pi * inside / duration) ** 2)
