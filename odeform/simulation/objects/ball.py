"""A soft hollow ball."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from odeform.geometry.primitives import octasphere
from odeform.schema import Parameter, Parameters
from odeform.simulation.errors import SimulationError
from odeform.simulation.material import Material, wall_thickness
from odeform.simulation.physics import GRAVITY
from odeform.types import Floats, Mesh

if TYPE_CHECKING:
    from odeform.simulation.shell import ShellBody

__all__ = [
    "FIXED",
    "MATERIAL",
    "NOTES",
    "RADIUS",
    "RESOLUTIONS",
    "SEGMENTS",
    "STEP",
    "bending",
    "mass",
    "relaxed",
    "rest_mesh",
    "sphere",
    "stress_free",
]

RADIUS = 0.100  # m
STEP = 5e-4  # s
SEGMENTS = 10  # along an edge of an octant: 402 vertices
RESOLUTIONS = (SEGMENTS, 8, 5)
MATERIAL = Material(young=0.13e6, poisson=0.3, viscosity=19.0, friction=0.5, contact_time=0.002)

NOTES = (
    "The ball is hollow. Its wall is 0.29 of the radius or thicker, too thick for the theory of thin shells, but the "
    "scene defines its stiffness by that theory: E h³ / (12 (1 - ν²)) in bending and E h in stretching, for Young's "
    "modulus E, Poisson's ratio ν and thickness h.",
    "The wall loses energy by a viscosity that does not depend on its stiffness, so that mass and bending stiffness "
    "have effects of their own.",
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
    """Returns the parameter `mass`, with its range in kg."""
    return Parameter("mass", "kg", low, high, default, scale="log", description="mass of the ball")


def bending(high: float) -> Parameter:
    """Returns the parameter `bending`, up to `high` N m."""
    return Parameter("bending", "N m", 0.3, high, 0.6, scale="log", description="bending stiffness of its wall")


def sphere(segments: int = SEGMENTS) -> Mesh:
    """Makes the mesh of the ball about the origin, resting on the middle of a triangle and symmetric about the plane
    y = 0.

    On a single vertex it would be unstable and roll in a direction that rounding decides. On three of them it rests,
    and a drop stays within 0.2 mm of its line. Raises `ValueError` for a multiple of 3 segments.
    """
    if segments % 3 == 0:
        raise ValueError(
            f"{segments} segments: expected no multiple of 3, which would put a vertex at the lowest point"
        )
    ball = octasphere(RADIUS, segments)
    up, side = np.array([1.0, 1.0, 1.0]) / math.sqrt(3.0), np.array([1.0, -1.0, 0.0]) / math.sqrt(2.0)
    return Mesh(ball.points @ np.stack([np.cross(side, up), side, up], axis=1), ball.faces)


def relaxed(mesh: Mesh, radius: float, thickness: float, material: Material) -> tuple[Mesh, Mesh]:
    """Relaxes the stress-free ball: (`reference` for the simulator, `rest` shape of mean radius `radius` m, centred at
    0).

    A sphere inflates as soon as it is simulated, so the reference is rescaled until its equilibrium has the radius.
    """
    # here, so that looking at a scene and training on its data need no simulator
    from odeform.simulation.shell import relax

    scale, mean = 1.0, 0.0
    for _ in range(20):
        reference = Mesh(mesh.points * scale, mesh.faces)
        rest = relax(reference, thickness, material)
        mean = float(np.linalg.norm(rest.points, axis=1).mean())
        if abs(mean - radius) < 1e-10:
            return reference, rest
        scale *= radius / mean
    raise SimulationError(f"the ball did not relax to radius {radius} m (last {mean} m) at thickness {thickness:.4f} m")


def stress_free(parameters: Parameters, step: float, segments: int = SEGMENTS) -> tuple[ShellBody, Floats, Mesh]:
    """The ball at rest, touching the floor: (body, its positions (N, 3) m about its centre, its mesh).

    `step` is in seconds; `segments` are along an edge of an octant of the mesh.
    """
    # here, so that looking at a scene and training on its data need no simulator
    from odeform.simulation.shell import ShellBody

    mesh = sphere(segments)
    thickness = wall_thickness(parameters["bending"], MATERIAL)
    reference, rest = relaxed(mesh, RADIUS, thickness, MATERIAL)
    body = ShellBody(reference, parameters["mass"], thickness, MATERIAL, step, GRAVITY)
    body.positions = rest.points - [0.0, 0.0, rest.points[:, 2].min()]
    return body, rest.points, mesh


def rest_mesh(height: float = 0.0) -> Mesh:
    """A fine ball whose lowest point is at `height` metres above the floor, for display."""
    fine = octasphere(RADIUS, segments=24)
    return Mesh(np.add(fine.points, (0.0, 0.0, RADIUS + height)), fine.faces)
