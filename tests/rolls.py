"""A data set of a ball that is thrown and rolls, by a known law of contact, with a dent where it touches the floor."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from odeform.dataset.index import Dataset, Entry, assign_splits_in_blocks
from odeform.geometry.primitives import octasphere
from odeform.geometry.rigid import rotation_from_vector
from odeform.geometry.shape import surface_weights
from odeform.mechanics.floor import GRAVITY
from odeform.mechanics.rolling.dynamics import STATE, RollingDynamics
from odeform.mechanics.rolling.law import RollingLaw, first_law
from odeform.mechanics.rolling.support import support_of
from odeform.schema import Parameter, Schema, Window
from odeform.types import Floats, MotionSequence

RADIUS, RATE, PULSE = 0.1, 120.0, 0.02
AXIS = np.array([0.0, 1.0, 0.0])
BALL = octasphere(RADIUS, 5)
BEGIN = 3.5 / RATE  # s: half a frame after the first that is free
SUBSTEPS = 4  # of half a frame
SCHEMA = Schema(
    scene="rolls",
    parameters=(
        Parameter("mass", "kg", 0.5, 1.0, 0.7, scale="log"),
        Parameter("force", "N", 40.0, 120.0, 60.0),
        Parameter("elevation", "rad", 0.4, 1.0, 0.6),
    ),
    window=Window(0.0, 0.5, RATE),
)


def true_law() -> RollingLaw:
    """Heavier balls sink deeper and bounce less; all bounce less and slide more than by the first law of a fit."""
    law = first_law(1, seed=0)
    terms = law.terms.copy()
    terms[:3, 1] = -0.8, 0.2, 0.6
    terms[2, 0] += 1.0
    terms[4, 0] -= 0.7
    return replace(law, terms=terms, last=np.zeros_like(law.last))


def launched(given: dict[str, float]) -> Floats:
    """(8,) the state when the push is over."""
    speed = 0.5 * PULSE * given["force"] / given["mass"]
    state = np.zeros(STATE)
    state[3], state[4] = speed * np.cos(given["elevation"]), speed * np.sin(given["elevation"])
    state[:2] = 0.5 * BEGIN * state[3:5]
    return state


def motion(given: dict[str, float]) -> MotionSequence:
    """All frames: three with a constant acceleration, then under the law."""
    times = np.arange(round(SCHEMA.window.stop * RATE) + 1) / RATE
    start, material = launched(given), np.array([[SCHEMA.parameters[0].normalise(given["mass"])]])
    law = true_law()
    dynamics = RollingDynamics(law, support_of(BALL.points, AXIS), RADIUS, material)
    count = 2 * (len(times) - 4)
    states = dynamics.roll_out(start[:, None], SUBSTEPS, count, 0.5 / RATE / SUBSTEPS)[1::2, :, 0]
    free = start[:3] - 0.5 / RATE * start[3:6] - [0.0, 0.5 * GRAVITY * (0.5 / RATE) ** 2, 0.0]
    moved = np.concatenate([np.outer((times[:4] / times[3]) ** 2, free), states[:, :3]])
    depth = np.maximum(1e-3 - moved[:, 1], 0.0) * (times > 0.0)
    turn = rotation_from_vector(moved[:, 2:3] * AXIS)
    turned = BALL.points @ turn.swapaxes(1, 2)
    near = np.exp(4.0 * (-turned[..., 2] / RADIUS - 1.0))
    turned[..., 2] += 2.0 * depth[:, None] * near
    vertices = turned + moved[:, None, :2] @ np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]) + [0.0, 0.0, RADIUS]
    weights = surface_weights(BALL)
    return MotionSequence(times, vertices.astype(np.float32), BALL.faces, weights, dict(given))


def rolls(count: int = 60, seed: int = 0) -> Dataset:
    """`count` sequences, in memory."""
    rng, held, entries = np.random.default_rng(seed), {}, []
    splits = assign_splits_in_blocks(count, 0, count)
    for index in range(count):
        given = {p.name: p.denormalise(float(rng.uniform(-1.0, 1.0))) for p in SCHEMA.parameters}
        entry = Entry(f"rolls_{index:05d}", splits[index], given, sha256=f"rolls{index}")
        held[entry.name] = replace(motion(given), name=entry.name)
        entries.append(entry)
    fixed = {"pulse_s": PULSE}
    return Dataset(Path("rolls"), SCHEMA, tuple(entries), lambda entry: held[entry.name], fixed=fixed)
