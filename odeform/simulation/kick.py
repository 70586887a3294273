"""Scene `kick`: a soft hollow ball on the floor gets a force pulse and is thrown, rolls and lands."""

import math

import numpy as np
import trimesh

from odeform.geometry.primitives import octasphere
from odeform.geometry.rigid import rotation_z
from odeform.schema import Parameter, Parameters, Schema, Window
from odeform.simulation.material import Material, wall_thickness
from odeform.simulation.scene import Scene
from odeform.types import Floats, Mesh, Sequence

__all__ = ["GRAVITY", "MATERIAL", "PULSE", "RADIUS", "SCENE", "STEP", "simulate"]

RADIUS = 0.100  # m
GRAVITY = 9.81  # m/s^2
PULSE = 0.020  # s
STEP = 5e-4  # s
SPREAD = math.radians(25.0)  # angular width of the pulse around the struck point
MATERIAL = Material(young=0.17e6, poisson=0.3, damping=0.003, friction=0.5, contact_time=0.002)

SCHEMA = Schema(
    scene="kick",
    parameters=(
        Parameter("mass", "kg", 0.3, 1.0, 0.5, scale="log", description="mass of the ball"),
        Parameter("bending", "N m", 0.3, 3.0, 0.6, scale="log", description="bending stiffness EI of its wall"),
        Parameter("force", "N", 70.0, 150.0, 120.0, description="peak of the pulse F sin^2(pi t / 20 ms)"),
        Parameter("azimuth", "rad", -math.pi, math.pi, 0.0, role="azimuth", description="heading of the pulse"),
        Parameter("elevation", "rad", 0.0, math.pi / 4, 0.6, description="rise of the pulse above the floor"),
    ),
    window=Window(0.0, 1.0, 120.0),
    notes=(
        "The wall is 0.27 to 0.59 of the radius: too thick for thin-shell theory, bending and stretching follow "
        "E h^3 / (12 (1 - nu^2)) and E h by definition of the scene.",
    ),
)


def pulse_direction(elevation: float) -> Floats:
    """Unit vector of the pulse in its own frame (x is the heading, z is up)."""
    return np.array([math.cos(elevation), 0.0, math.sin(elevation)])


def pulse_weights(rest: Floats, elevation: float) -> Floats:
    """(N,) share of the pulse at each vertex, exp(-(angle / 25 deg)^2) around the struck point, summing to 1."""
    outward = rest / np.linalg.norm(rest, axis=1, keepdims=True)
    angle = np.arccos(np.clip(-outward @ pulse_direction(elevation), -1.0, 1.0))
    weights = np.exp(-((angle / SPREAD) ** 2))
    return weights / weights.sum()


def simulate(parameters: Parameters, rate: float | None = None, step: float = STEP, level: int = 2) -> Sequence:
    """One motion over the scene's window, frames at `rate` Hz (default: the window's).

    The ball is an icosphere of 10 * 4^level + 2 vertices, oriented with the pulse: the heading is a symmetry of the
    scene, and a mesh that turns with it keeps this symmetry exact.
    """
    # here, so that looking at a scene and training on its data need no simulator
    from odeform.simulation.shell import ShellBody, relax_sphere, run

    window = SCHEMA.window
    thickness = wall_thickness(parameters["bending"], MATERIAL)
    sphere = trimesh.creation.icosphere(level, RADIUS)
    mesh = Mesh(np.asarray(sphere.vertices), np.asarray(sphere.faces))
    reference, rest = relax_sphere(mesh, RADIUS, thickness, MATERIAL)
    body = ShellBody(reference, parameters["mass"], thickness, MATERIAL, step, GRAVITY)
    body.positions = rest.points - [0.0, 0.0, rest.points[:, 2].min()]
    elevation = parameters["elevation"]
    load = pulse_weights(rest.points, elevation)[:, None] * pulse_direction(elevation) * parameters["force"]

    def force(time: float) -> Floats | None:
        return load * math.sin(math.pi * time / PULSE) ** 2 if time < PULSE else None

    times, vertices = run(body, window.stop - window.start, rate or window.rate, force)
    turned = vertices @ rotation_z(parameters["azimuth"]).T
    return Sequence(times, turned.astype(np.float32), mesh.faces, body.weights, dict(parameters))


def rest_mesh() -> Mesh:
    """A fine ball touching the floor, for display."""
    sphere = octasphere(RADIUS, segments=24)
    return Mesh(np.add(sphere.points, (0.0, 0.0, RADIUS)), sphere.faces)


SCENE = Scene(
    schema=SCHEMA,
    simulate=simulate,
    rest_mesh=rest_mesh,
    step=STEP,
    fixed={
        "radius_m": RADIUS,
        "gravity_m_s2": GRAVITY,
        "pulse_s": PULSE,
        "pulse_spread_rad": SPREAD,
        "young_pa": MATERIAL.young,
        "poisson": MATERIAL.poisson,
        "damping_s": MATERIAL.damping,
        "friction": MATERIAL.friction,
        "contact_time_s": MATERIAL.contact_time,
    },
)
