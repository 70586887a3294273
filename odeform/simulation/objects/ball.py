"""The soft hollow ball that the scenes of this package throw and drop."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from odeform.geometry.primitives import octasphere
from odeform.schema import Parameter, Parameters
from odeform.simulation.material import Material, wall_thickness
from odeform.types import Floats, Mesh

if TYPE_CHECKING:
    from odeform.simulation.shell import ShellBody

__all__ = [
    "FIXED",
    "GRAVITY",
    "MATERIAL",
    "NOTES",
    "RADIUS",
    "SEGMENTS",
    "STEP",
    "bending",
    "mass",
    "rest_mesh",
    "sphere",
    "stress_free",
]

RADIUS = 0.100  # m
GRAVITY = 9.81  # m/s^2
STEP = 5e-4  # s
SEGMENTS = 10  # 402 vertices
MATERIAL = Material(young=0.13e6, poisson=0.3, viscosity=19.0, friction=0.5, contact_time=0.002)

NOTES = (
    "The wall is 0.29 of the radius or more: too thick for thin-shell theory, bending and stretching follow "
    "E h^3 / (12 (1 - nu^2)) and E h by definition of the scene.",
    "Losses are those of a lining of fixed viscosity, so that mass and bending act apart and not by their ratio alone.",
)

FIXED = {
    "radius_m": RADIUS,
    "vertices": 4 * SEGMENTS**2 + 2,
    "gravity_m_s2": GRAVITY,
    "young_pa": MATERIAL.young,
    "poisson": MATERIAL.poisson,
    "viscosity_n_s_m": MATERIAL.viscosity,
    "friction": MATERIAL.friction,
    "contact_time_s": MATERIAL.contact_time,
}


def mass(low: float, high: float, default: float) -> Parameter:
    return Parameter("mass", "kg", low, high, default, scale="log", description="mass of the ball")


def bending(high: float) -> Parameter:
    return Parameter("bending", "N m", 0.3, high, 0.6, scale="log", description="bending stiffness EI of its wall")


def sphere(segments: int = SEGMENTS) -> Mesh:
    """The ball's mesh about the origin, standing on the middle of a triangle and mirrored across the plane y = 0.

    On a vertex it would stand as on a needle and roll off in a direction that rounding decides; with three of them
    on the floor it rests, and a drop stays within 0.2 mm of its line.
    """
    if segments % 3 == 0:
        raise ValueError(f"{segments} segments: expected no multiple of 3, which puts a vertex in the middle")
    ball = octasphere(RADIUS, segments)
    up, side = np.array([1.0, 1.0, 1.0]) / math.sqrt(3.0), np.array([1.0, -1.0, 0.0]) / math.sqrt(2.0)
    return Mesh(ball.points @ np.stack([np.cross(side, up), side, up], axis=1), ball.faces)


def stress_free(parameters: Parameters, step: float, segments: int = SEGMENTS) -> tuple[ShellBody, Floats, Mesh]:
    """The ball at rest, touching the floor: (body, its positions (N, 3) about its centre, its mesh)."""
    # here, so that looking at a scene and training on its data need no simulator
    from odeform.simulation.shell import ShellBody, relax_sphere

    mesh = sphere(segments)
    thickness = wall_thickness(parameters["bending"], MATERIAL)
    reference, rest = relax_sphere(mesh, RADIUS, thickness, MATERIAL)
    body = ShellBody(reference, parameters["mass"], thickness, MATERIAL, step, GRAVITY)
    body.positions = rest.points - [0.0, 0.0, rest.points[:, 2].min()]
    return body, rest.points, mesh


def rest_mesh(height: float = 0.0) -> Mesh:
    """A fine ball whose lowest point is at `height` metres above the floor, for display."""
    fine = octasphere(RADIUS, segments=24)
    return Mesh(np.add(fine.points, (0.0, 0.0, RADIUS + height)), fine.faces)
