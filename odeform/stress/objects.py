"""The stability of models that have one for each object: pushes or other loads of all of them, until they rest."""

import time
from collections import Counter
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.loads.registry import first_body, load_of_scene
from odeform.loads.situation import Flight
from odeform.models import registry
from odeform.models.base import Predictor
from odeform.models.modal import energy_bound
from odeform.models.modal.model import ModalModel
from odeform.models.per_object import PerObject
from odeform.motion.base import Motion
from odeform.motion.rest import rests_from
from odeform.parallel import parallel_map
from odeform.schema import OBJECT, Parameters, Schema, Window
from odeform.simulation.objects.soft_object import SoftObject
from odeform.simulation.scenes.registry import find_scene
from odeform.simulation.scenes.user_object import scene_with
from odeform.stress.check import Check
from odeform.stress.energy import energy_gained
from odeform.types import Frames, Points, Times

__all__ = ["BEYOND", "Watched", "draws_of", "end_of", "stress_objects", "watch", "with_body"]

BEYOND = 1.25  # times the trained forces, at most
PATIENCE = 10.0  # s
BATCH = 32  # pushes that a process takes at a time
FLAT, START = 2e-3, 1e-3  # m, under loads: what may be below the floor, and how far off a start in the air may be
GAINED = 0.02  # of the energy in the air: what differences of frames are off by
MOVING = 0.02  # fraction of bodies that may still move at the end


@dataclass(frozen=True)
class Watched:
    """What one motion did, from its start until the model knows no more of it."""

    status: str
    non_finite: int
    """Frames that are not finite."""
    start_off: float
    """m between its first frame and where it should begin."""
    depth: float
    """m below the floor, or inside an obstacle, at most."""
    held: float
    """Fraction of the frames that show an earlier moment, because it is not valid."""
    rests: bool
    seconds: float
    gained: float = 0.0
    """Fraction of the energy that a body in the air begins with by which it later has more."""


def draws_of(schema: Schema, count: int, seed: int, item: SoftObject | None = None) -> list[dict[str, Any]]:
    """`count` pushes of all objects in turn, drawn as their data are, with up to `BEYOND` times the force, and with
    masses and stiffnesses from all of their ranges. An `item` is the only object, a shape of the user's own."""
    scene = find_scene(schema.scene) if item is None else scene_with(schema.scene, item)
    assert scene is not None
    rng, each = np.random.default_rng(seed), -(-count // len(schema.objects))
    drawn = scene.sample(each, seed, schema.objects)
    out = [dict(row) for index in range(each) for row in drawn[index::each]][:count]
    for row in out:
        strength = rng.uniform(0.0, BEYOND)
        row |= {name: strength * value for name, value in row.items() if name.startswith("force_")}
    return out


def with_body(model: PerObject, index: int, push: Parameters) -> dict[str, Any]:
    """The draw number `index` with a mass and a stiffness from the ranges of its object."""
    rng, own = np.random.default_rng(index), model.parts[push[OBJECT]].schema.parameters
    return {**push, **{p.name: p.denormalise(rng.uniform(-1.0, 1.0)) for p in own if p.role == "body"}}


def end_of(window: Window) -> float:
    """Seconds until which a model knows a motion."""
    return window.start + (1.0 + window.reach) * (window.stop - window.start)


def watch(model: PerObject, draw: tuple[int, Parameters]) -> Watched:
    """Solve one push, with a mass and a stiffness drawn from the ranges of its object, and look at all of its
    frames."""
    index, push = draw
    part, parameters, begin = model.parts[push[OBJECT]], with_body(model, index, push), time.perf_counter()
    try:
        motion = model.solve(parameters=parameters)
        window = motion.schema.window
        end = end_of(window)
        times = np.arange(0.0, end, 1.0 / window.rate)
        frames = motion.vertices(times)
        stops = [motion.stop_at(float(moment)) for moment in times]
        held = sum(stop is not None and not stop.limited for stop in stops) / len(times)
        rests = window.reach == 0.0 or rests_from(motion, end) is not None
        status, begun = motion.stats.status, _start_off(model, parameters, frames[0])
        gained = _gained(part, motion, times)
    except InputError:
        return Watched("refused", 0, 0.0, 0.0, 0.0, True, time.perf_counter() - begin)
    except Exception as error:
        return Watched(f"fault: {type(error).__name__}", 0, 0.0, 0.0, 0.0, False, time.perf_counter() - begin)
    finite, floor = np.isfinite(frames).all(axis=(1, 2)), motion.validity.limits.floor
    depth = 0.0 if floor is None or not finite.any() else floor - float(frames[finite][..., 2].min())
    depth = max(depth, _inside(model, motion.parameters, frames[finite]))
    return Watched(status, int((~finite).sum()), begun, depth, held, rests, time.perf_counter() - begin, gained)


def _gained(part: Predictor, motion: Motion, times: Times) -> float:
    flight = _flight(part, motion.parameters)
    return 0.0 if flight is None or not isinstance(part, ModalModel) else energy_gained(part, motion, flight, times)


def _flight(model: Predictor, parameters: Parameters) -> Flight | None:
    """How a motion begins in the air; None for one that begins at rest."""
    load = load_of_scene(model.schema.scene)
    return load.situation(model.rest_of(parameters), parameters).flight if load is not None and load.flies else None


def _inside(model: PerObject, parameters: Parameters, frames: Frames) -> float:
    """m by which frames (T, N, 3), or the middles of sides of their faces, are inside an obstacle, at most; negative
    outside of all."""
    load = load_of_scene(model.schema.scene)
    obstacles = () if load is None or not len(frames) else load.obstacles(parameters)
    if not obstacles:
        return float("-inf")
    corners = frames[:, model.rest_of(parameters).faces]
    middles = 0.5 * (corners + np.roll(corners, 1, axis=2))
    met = [obstacle.met(places)[0].min() for obstacle in obstacles for places in (frames, middles)]
    return -float(min(met))


def _start_off(model: PerObject, parameters: Parameters, frame: Points) -> float:
    """m between the first frame (N, 3) and where the motion should begin: at rest, or with its lowest point so high."""
    if (flight := _flight(model, parameters)) is None:
        return float(np.abs(frame - model.settled(parameters).points).max())
    thrown = frame[first_body(model.schema.scene, len(frame))]
    return abs(float(thrown[:, 2].min()) - flight.height)


def stress_objects(checkpoint: str, draws: int, seed: int = 0) -> dict[str, Any]:
    """`draws` pushes and the checks over them, as JSON; the seed fixes everything but times."""
    model = _opened(checkpoint)
    first = next(iter(model.parts.values()))
    item = first.solid if isinstance(first, ModalModel) else None
    rows = list(enumerate(draws_of(model.schema, draws, seed, item)))
    found = parallel_map("motions", partial(_watched_from, checkpoint), rows, batch_size=BATCH)
    load = load_of_scene(model.schema.scene)
    depth = FLAT if load else max(part.validity.limits.depth for part in model.parts.values())
    checks = {
        "faults": Check(sum(one.status.startswith("fault") for one in found), 0),
        "non_finite_frames": Check(sum(one.non_finite for one in found), 0),
        "start_off_m": Check(max(one.start_off for one in found), START if load and load.flies else 0.0),
        "shown_below_floor_mm": Check(1e3 * max(one.depth for one in found), 1e3 * depth),
        "energy_gained": Check(max(one.gained for one in found), GAINED),
        "ended_by_energy": Check(sum(one.status == energy_bound.STATUS for one in found), 0),
        "held_frames": Check(float(np.mean([one.held for one in found])), 0.05),
        "slowest_case_s": Check(max(one.seconds for one in found), PATIENCE),
    }
    if load is None or not load.held:  # a held body swings on
        checks["moving_at_the_end"] = Check(float(np.mean([not one.rests for one in found])), MOVING)
    return {
        "cases": len(found),
        "non_finite_shown": sum(one.non_finite for one in found),
        "by_status": dict(Counter(one.status for one in found).most_common()),
        "checks": {name: check.to_json() for name, check in checks.items()},
    }


@cache
def _opened(checkpoint: str) -> PerObject:
    """Opened once in each process."""
    model = registry.load(checkpoint)
    assert isinstance(model, PerObject)
    return model


def _watched_from(checkpoint: str, draw: tuple[int, Parameters]) -> Watched:
    return watch(_opened(checkpoint), draw)
