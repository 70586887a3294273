"""Scene `kick`: a soft hollow ball on the floor gets a force pulse and is thrown, rolls and lands."""

import math
from collections.abc import Callable

import numpy as np

from odeform.geometry.rigid import rotation_z
from odeform.loads.arrow import Arrow
from odeform.schema import Parameter, Parameters, Schema, Window
from odeform.simulation.objects.ball import (
    FIXED,
    NOTES,
    RESOLUTIONS,
    SEGMENTS,
    STEP,
    bending,
    mass,
    rest_mesh,
    stress_free,
)
from odeform.simulation.physics import GRAVITY
from odeform.simulation.scene import Scene
from odeform.simulation.stepping import run
from odeform.types import Floats, MotionSequence, Points

__all__ = ["ARROW", "PULSE", "SCENE", "glyphs", "simulate"]

PULSE = 0.020  # s
SPREAD = math.radians(25.0)  # angular width of the pulse around the struck point
ARROW = 0.32  # length of the arrow at the highest force, in sizes of the body
ABOVE = 0.9  # of the way from the struck point back to the floor, which a steep arrow may take

SCHEMA = Schema(
    scene="kick",
    parameters=(
        # lighter balls or stronger kicks land at more than 4 m/s, where the floor of the simulator gives way by 5 mm;
        # softer walls would touch themselves
        mass(0.4, 1.5, 0.7),
        bending(3.0),
        Parameter("force", "N", 10.0, 160.0, 120.0, description="peak of the force, which acts for 20 ms"),
        Parameter(
            "azimuth",
            "rad",
            -math.pi,
            math.pi,
            0.0,
            role="azimuth",
            description="direction of the kick about the vertical, from x",
        ),
        Parameter("elevation", "rad", 0.0, 1.2, 0.6, description="angle of the kick above the floor"),
    ),
    window=Window(0.0, 1.0, 120.0),
    notes=NOTES,
)


def pulse_direction(elevation: float) -> Floats:
    """Returns the unit vector of the pulse in its own frame (x is the azimuth, z is up)."""
    return np.array([math.cos(elevation), 0.0, math.sin(elevation)])


def pulse_weights(rest: Floats, elevation: float) -> Floats:
    """Computes the fraction (N,) of the pulse at each vertex, exp(-(angle / 25 deg)^2) around the struck point,
    summing to 1."""
    outward = rest / np.linalg.norm(rest, axis=1, keepdims=True)
    angle = np.arccos(np.clip(-outward @ pulse_direction(elevation), -1.0, 1.0))
    weights = np.exp(-((angle / SPREAD) ** 2))
    return weights / weights.sum()


def simulate(
    parameters: Parameters,
    rate: float | None = None,
    step: float = STEP,
    resolution: int = SEGMENTS,
    report: Callable[[float], None] = lambda _: None,
    until: float = SCHEMA.window.stop,
) -> MotionSequence:
    """Simulates one motion up to `until` seconds, with frames at `rate` Hz (default: the window's).

    `step` is in seconds, `resolution` in segments of the ball's mesh; `report` gets the fraction done. The mesh is
    oriented with the pulse: the azimuth is a symmetry of the scene, and a mesh that turns with it keeps this symmetry
    exact. Raises `SimulationError`.
    """
    body, rest, mesh = stress_free(parameters, step, resolution)
    elevation = parameters["elevation"]
    load = pulse_weights(rest, elevation)[:, None] * pulse_direction(elevation) * parameters["force"]

    def force(time: float) -> Floats | None:
        return load * math.sin(math.pi * time / PULSE) ** 2 if time < PULSE else None

    times, vertices = run(body, until, rate or SCHEMA.window.rate, force, report=lambda now: report(now / until))
    turned = vertices @ rotation_z(parameters["azimuth"]).T
    return MotionSequence(times, turned.astype(np.float32), mesh.faces, body.weights, dict(parameters))


def glyphs(parameters: Parameters, rest_points: Points) -> tuple[Arrow, ...]:
    """The pulse, as an arrow whose tip is at the struck point, with a length in proportion to its force.

    The steeper of them are shorter, so that they begin above the floor.
    """
    if not {"force", "elevation"} <= set(parameters):
        return ()
    force, size = parameters["force"], float(np.ptp(rest_points, axis=0).max())
    direction = rotation_z(parameters.get("azimuth", 0.0)) @ pulse_direction(parameters["elevation"])
    struck = 0.5 * (rest_points.min(axis=0) + rest_points.max(axis=0)) - 0.5 * size * direction
    high = next(p.high for p in SCHEMA.parameters if p.name == "force")
    floor = 0.5 / max(float(direction[2]), 1e-6) - 0.5  # bodies stand on the floor
    vector = min(ARROW, ABOVE * floor) * size * max(force, 0.0) / high * direction
    # a flat shape is struck further up than a ball, for the same reason
    struck[2] += max(float(rest_points[:, 2].min()) - (struck - vector)[2], 0.0)
    return (Arrow(struck - vector, vector, f"{force:.0f} N", 0.0, PULSE, rises=True),)


SCENE = Scene(
    schema=SCHEMA,
    simulate=simulate,
    rest_mesh=rest_mesh,
    step=STEP,
    count=700,
    fixed={**FIXED, "pulse_s": PULSE, "pulse_spread_rad": SPREAD},
    gravity=GRAVITY,
    resolutions=RESOLUTIONS,
    glyphs=glyphs,
)
