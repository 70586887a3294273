"""Data sets of a ball that is thrown and rolls, or falls straight, by known contact parameters, with a dent where it
touches the floor."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from odeform.dataset.index import Dataset, Entry, assign_splits_in_blocks
from odeform.geometry.primitives import octasphere
from odeform.geometry.rigid import rotation_from_vector
from odeform.geometry.shape import surface_weights
from odeform.mechanics.floor import GRAVITY
from odeform.mechanics.rolling.contact import RollingContact, initial_contact
from odeform.mechanics.rolling.dynamics import STATE, RollingDynamics
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


def true_contact() -> RollingContact:
    """Heavier balls sink deeper and bounce less; all bounce less and slide more than by the first contact of a fit."""
    contact = initial_contact(1, seed=0)
    terms = contact.terms.copy()
    terms[:3, 1] = -0.8, 0.2, 0.6
    terms[2, 0] += 1.0
    terms[4, 0] -= 0.7
    return replace(contact, terms=terms, last=np.zeros_like(contact.last))


def launched(given: dict[str, float]) -> Floats:
    """(8,) the state when the push is over."""
    speed = 0.5 * PULSE * given["force"] / given["mass"]
    state = np.zeros(STATE)
    state[3], state[4] = speed * np.cos(given["elevation"]), speed * np.sin(given["elevation"])
    state[:2] = 0.5 * BEGIN * state[3:5]
    return state


def motion(given: dict[str, float]) -> MotionSequence:
    """All frames: three with a constant acceleration, then under the contact."""
    times = np.arange(round(SCHEMA.window.stop * RATE) + 1) / RATE
    start, material = launched(given), np.array([[SCHEMA.parameters[0].normalise(given["mass"])]])
    contact = true_contact()
    dynamics = RollingDynamics(contact, support_of(BALL.points, AXIS), RADIUS, material)
    count = 2 * (len(times) - 4)
    states = dynamics.roll_out(start[:, None], SUBSTEPS, count, 0.5 / RATE / SUBSTEPS)[1::2, :, 0]
    free = start[:3] - 0.5 / RATE * start[3:6] - [0.0, 0.5 * GRAVITY * (0.5 / RATE) ** 2, 0.0]
    moved = np.concatenate([np.outer((times[:4] / times[3]) ** 2, free), states[:, :3]])
    return recorded(times, moved, given)


def recorded(times: Floats, moved: Floats, given: dict[str, float]) -> MotionSequence:
    """What is seen of a ball that is (T, 3) ahead, above where it would touch the floor (m), and turned (rad)."""
    depth = np.maximum(1e-3 - moved[:, 1], 0.0) * (times > 0.0)
    turn = rotation_from_vector(moved[:, 2:3] * AXIS)
    turned = BALL.points @ turn.swapaxes(1, 2)
    near = np.exp(4.0 * (-turned[..., 2] / RADIUS - 1.0))
    weights = surface_weights(BALL)
    turned[..., 2] += 2.0 * depth[:, None] * (near - (near @ weights)[:, None])  # the mass centre follows the ODE
    vertices = turned + moved[:, None, :2] @ np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]) + [0.0, 0.0, RADIUS]
    return MotionSequence(times, vertices.astype(np.float32), BALL.faces, weights, dict(given))


FALL = Schema(
    scene="falls",
    parameters=(Parameter("mass", "kg", 0.5, 1.0, 0.7, scale="log"),),
    window=Window(0.0, 0.5, RATE),
)
HEIGHT = 0.1  # m


def fall(given: dict[str, float]) -> MotionSequence:
    """All frames of a ball that falls from rest under the contact of `motion`, but bounces more."""
    times = np.arange(round(FALL.window.stop * RATE) + 1) / RATE
    contact, material = true_contact(), np.array([[FALL.parameters[0].normalise(given["mass"])]])
    terms = contact.terms.copy()
    terms[2, 0] -= 1.5
    dynamics = RollingDynamics(replace(contact, terms=terms), support_of(BALL.points, AXIS), RADIUS, material)
    start = np.zeros((STATE, 1))
    start[1] = HEIGHT
    moved = dynamics.roll_out(start, 4 * SUBSTEPS, len(times) - 1, 0.25 / RATE / SUBSTEPS)[:, :3, 0]
    moved[:, [0, 2]] = 0.0
    return recorded(times, moved, given)


def rolls(count: int = 60, seed: int = 0) -> Dataset:
    """`count` sequences of balls that are pushed, in memory."""
    return _dataset(SCHEMA, motion, count, seed, {"pulse_s": PULSE})


def falls(count: int = 20, seed: int = 0) -> Dataset:
    """`count` sequences of balls that fall, in memory."""
    return _dataset(FALL, fall, count, seed, {})


def _dataset(
    schema: Schema,
    made: Callable[[dict[str, float]], MotionSequence],
    count: int,
    seed: int,
    fixed: dict[str, float],
) -> Dataset:
    rng, held, entries = np.random.default_rng(seed), {}, []
    splits = assign_splits_in_blocks(count, 0, count)
    for index in range(count):
        given = {p.name: p.denormalise(float(rng.uniform(-1.0, 1.0))) for p in schema.parameters}
        entry = Entry(f"{schema.scene}_{index:05d}", splits[index], given, sha256=f"{schema.scene}{index}")
        held[entry.name] = replace(made(given), name=entry.name)
        entries.append(entry)
    return Dataset(Path(schema.scene), schema, tuple(entries), lambda entry: held[entry.name], fixed=fixed)
