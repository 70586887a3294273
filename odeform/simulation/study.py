"""Is a scene's simulation sound? `python -m odeform.simulation.study SCENE`, on a handful of its sequences.

Prints JSON: what halving the time step changes, how far the floor is penetrated, how much the ball flattens and
rebounds, and whether mass, bending and force leave separate marks on the first contact (later ones shift in time and
chatter: differences do not resolve them). The shipped figures are in `assets/studies`.
"""

import argparse
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed

from odeform.errors import InputError
from odeform.io import atomic_write
from odeform.schema import Parameter
from odeform.simulation.scene import Scene, get_scene
from odeform.types import MotionSequence

__all__ = ["main", "study"]

NUDGE = 0.03  # of a parameter's trained range, each way, for the sensitivities
RATE = 480.0  # Hz
HIDDEN = ("mass", "bending", "force")  # what a motion is asked for; where it was aimed can be seen
CONTACT = 2e-3  # m; a vertex lower than this touches the floor
LOW = 1e-2  # m; a lower rebound is a roll, and its change means nothing


def _contacts(sequence: MotionSequence) -> list[slice]:
    """Frames during which any vertex touches the floor, one slice a contact."""
    touching = sequence.vertices[..., 2].min(axis=1) < CONTACT
    edges = np.flatnonzero(np.diff(np.concatenate([[False], touching, [False]])))
    return [slice(begin, end) for begin, end in edges.reshape(-1, 2)]


def _rebound(sequence: MotionSequence) -> float | None:
    """Metres that the centre of mass rises above its rest position after the first landing; None without one."""
    height = np.einsum("n,tn->t", sequence.weights, sequence.vertices[..., 2].astype(float))
    landing = next((contact.start for contact in _contacts(sequence) if contact.start > 0), None)
    return None if landing is None else float(height[landing:].max() - min(height[0], height[-1]))


def _rmse(a: MotionSequence, b: MotionSequence) -> float:
    return float(np.sqrt(np.mean((a.vertices.astype(float) - b.until(a.times[-1]).vertices) ** 2)))


def _run(scene: Scene, parameters: dict[str, float], step: float) -> MotionSequence:
    return scene.simulate(parameters, rate=RATE, step=step)


def _condition(frames: slice, nudged: list[MotionSequence]) -> float:
    """Condition number of the sensitivities to the normalised parameters over some frames, by central differences."""
    moved = [s.until(frames.stop / RATE).vertices[frames].astype(float).ravel() for s in nudged]
    return float(np.linalg.cond(np.stack([b - a for a, b in zip(moved[::2], moved[1::2], strict=True)], axis=1)))


def study(scene_name: str, count: int, seed: int, workers: int) -> dict[str, Any]:
    """The figures of `count` sequences: the corners of the trained box first, space-filling samples after."""
    scene = get_scene(scene_name)
    learned = scene.schema.learned
    defaults = scene.schema.complete(None)
    # softest and heaviest, stiffest and lightest: where a ball flattens most, and where its contact is hardest
    corners = [
        {**defaults, **{p.name: (p.high if (p.name == "bending") == stiff else p.low) for p in learned}}
        for stiff in (False, True)
    ]
    settings = [*corners, *scene.sample(count, seed)][:count]

    def nudge(parameters: dict[str, float], parameter: Parameter, by: float) -> dict[str, float]:
        unit = parameter.normalise(parameters[parameter.name])
        return {**parameters, parameter.name: parameter.denormalise(unit + 2.0 * by)}

    jobs = [(p, scene.step) for p in settings] + [(p, 0.5 * scene.step) for p in settings]
    hidden = [p for p in learned if p.name in HIDDEN]
    jobs += [(nudge(p, q, by), scene.step) for p in settings for q in hidden for by in (-NUDGE, NUDGE)]
    parallel: Any = Parallel(n_jobs=workers, verbose=5)
    motions: list[MotionSequence] = parallel(delayed(_run)(scene, *job) for job in jobs)
    coarse, fine = motions[:count], motions[count : 2 * count]
    width = 2 * len(hidden)
    nudged = [motions[at : at + width] for at in range(2 * count, len(motions), width)]
    rows = []
    for parameters, a, b, others in zip(settings, coarse, fine, nudged, strict=True):
        extent = np.ptp(a.vertices[..., 2], axis=1)
        before, after = _rebound(a), _rebound(b)
        change = None if before is None or after is None or after < LOW else abs(before - after) / after
        rows.append(
            {
                "parameters": parameters,
                "seconds": float(a.times[-1]),
                "halving_rmse_mm": 1e3 * _rmse(a, b),
                "rebound_mm": None if before is None else 1e3 * before,
                "rebound_change": change,
                "penetration_mm": float(-1e3 * a.vertices[..., 2].min()),
                "flattening": float(1.0 - extent.min() / extent[0]),
                "condition": _condition(_contacts(a)[0], others),
            }
        )
    return {
        "scene": scene_name,
        "command": f"python -m odeform.simulation.study {scene_name} --count {count} --seed {seed}",
        "step_ms": 1e3 * scene.step,
        "fixed": scene.fixed,
        "halving_rmse_mm": float(np.sqrt(np.mean([row["halving_rmse_mm"] ** 2 for row in rows]))),
        **{
            f"largest_{key}": max((row[key] for row in rows if row[key] is not None), default=None)
            for key in ("rebound_change", "rebound_mm", "penetration_mm", "flattening", "condition")
        },
        "sequences": rows,
    }


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m odeform.simulation.study", description=__doc__)
    parser.add_argument("scene")
    parser.add_argument("--count", type=int, default=10, metavar="N")
    parser.add_argument("--seed", type=int, default=0, metavar="S")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="W")
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    if args.count < 1:
        parser.error("expected at least one sequence")
    try:
        text = json.dumps(study(args.scene, args.count, args.seed, args.workers), indent=1)
    except InputError as error:
        parser.error(str(error))
    if args.json:
        atomic_write(Path(args.json), text.encode())
    else:
        print(text)


if __name__ == "__main__":
    main()
