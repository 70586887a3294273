"""Scene `mass-elastic`: a soft hollow ball falls, lands, bounces and comes to rest (the paper's drop)."""

import math
from collections.abc import Callable

import numpy as np

from odeform.schema import Parameters, Schema, Window
from odeform.simulation.errors import SimulationError
from odeform.simulation.objects.ball import (
    FIXED,
    NOTES,
    RADIUS,
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
from odeform.simulation.stepping import Rest, run
from odeform.types import Mesh, MotionSequence

__all__ = ["SCENE", "simulate"]

HEIGHT = 0.5  # m, of the ball's centre above the floor
LIMIT = 10.0  # s
REST_SPEED = 1e-3  # m/s, RMS over the mass
REST_TIME = 0.1  # s for which the ball has to be that slow

SCHEMA = Schema(
    scene="mass-elastic",
    parameters=(mass(0.2, 1.0, 0.5), bending(3.0)),
    window=Window(0.0, 1.25, 120.0),
    impact=(0.25, 0.75),
    notes=(
        *NOTES,
        "A sequence ends when the RMS speed has been below 1 mm/s for 0.1 s; later the ball lies as it lay then.",
    ),
)


def simulate(
    parameters: Parameters,
    rate: float | None = None,
    step: float = STEP,
    resolution: int = SEGMENTS,
    report: Callable[[float], None] = lambda _: None,
) -> MotionSequence:
    """One drop until the ball rests, with frames at `rate` Hz (default: the window's).

    `step` is in seconds, `resolution` in segments of the ball's mesh; `report` gets the fraction done. A stress-free
    ball falls as a point does; the simulator takes over shortly before it lands. Raises `SimulationError`.
    """
    rate = rate or SCHEMA.window.rate
    body, rest, mesh = stress_free(parameters, step, resolution)
    clearance = HEIGHT + rest[:, 2].min()
    landing = math.sqrt(2.0 * clearance / GRAVITY)
    begin = (landing - 5e-3) // STEP * STEP
    body.positions = np.add(body.positions, (0.0, 0.0, clearance - 0.5 * GRAVITY * begin**2))
    body.velocities[:] = [0.0, 0.0, -GRAVITY * begin]
    falling = np.arange(math.ceil(begin * rate - 1e-9)) / rate
    height = HEIGHT - 0.5 * GRAVITY * falling**2
    fall = rest + height[:, None, None] * np.array([0.0, 0.0, 1.0])
    times, vertices = run(
        body,
        LIMIT,
        rate,
        begin=begin,
        rest=Rest(REST_SPEED, REST_TIME),
        report=lambda now: report(now / SCHEMA.window.stop),
    )
    if times[-1] > LIMIT - 1.0 / rate:
        raise SimulationError(f"the ball has not come to rest within {LIMIT:g} s")
    return MotionSequence(
        np.concatenate([falling, times]),
        np.concatenate([fall, vertices]).astype(np.float32),
        mesh.faces,
        body.weights,
        dict(parameters),
    )


def _mesh() -> Mesh:
    return rest_mesh(HEIGHT - RADIUS)


SCENE = Scene(
    schema=SCHEMA,
    simulate=simulate,
    rest_mesh=_mesh,
    step=STEP,
    count=500,
    fixed={**FIXED, "height_m": HEIGHT, "rest_speed_m_s": REST_SPEED, "rest_time_s": REST_TIME},
    gravity=GRAVITY,
    resolutions=RESOLUTIONS,
)
