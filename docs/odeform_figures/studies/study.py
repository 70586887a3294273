"""Is a scene's simulation sound? `python -m odeform_figures.studies.study SCENE` answers on a few of its sequences.

Prints JSON: how much halving the time step changes a motion, the scene's own figures (for a ball: how far it sinks into
the floor, flattens and rebounds), and whether its parameters leave separate marks on the motion. The shipped figures
are in `assets/studies`.
"""

import argparse
import os
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.parallel import parallel_map
from odeform.schema import Parameter, Parameters
from odeform.simulation.scenes.registry import SCENES, get_scene
from odeform.types import MotionSequence
from odeform_figures.output import write_or_print
from odeform_figures.studies.measurements import Measurements, measurements_of

__all__ = ["main", "study"]

NUDGE = 0.03  # of a parameter's trained range, each way, for the sensitivities
RATE = 480.0  # Hz


def _rmse(a: MotionSequence, b: MotionSequence) -> float:
    return float(np.sqrt(np.mean((a.vertices.astype(float) - b.until(a.times[-1]).vertices) ** 2)))


def _run(simulate: Callable[..., MotionSequence], job: tuple[Parameters, float]) -> MotionSequence:
    parameters, step = job
    return simulate(parameters, rate=RATE, step=step)


def _condition(frames: slice, nudged: list[MotionSequence]) -> float:
    """Condition number of the sensitivities to the normalised parameters over some frames, by central differences."""
    moved = [s.until(frames.stop / RATE).vertices[frames].astype(float).ravel() for s in nudged]
    return float(np.linalg.cond(np.stack([b - a for a, b in zip(moved[::2], moved[1::2], strict=True)], axis=1)))


def _nudge(parameters: Parameters, parameter: Parameter, by: float) -> dict[str, float]:
    unit = parameter.normalise(parameters[parameter.name])
    return {**parameters, parameter.name: parameter.denormalise(unit + 2.0 * by)}


def _row(
    measured: Measurements,
    parameters: Parameters,
    coarse: MotionSequence,
    fine: MotionSequence,
    nudged: list[MotionSequence],
) -> dict[str, Any]:
    """The figures of one sequence, at the scene's time step and at half of it."""
    return {
        "parameters": dict(parameters),
        "seconds": float(coarse.times[-1]),
        "halving_rmse_mm": 1e3 * _rmse(coarse, fine),
        **measured.figures(coarse, fine),
        "condition": _condition(measured.frames(coarse), nudged),
    }


def study(scene_name: str, count: int, seed: int, workers: int) -> dict[str, Any]:
    """Measures the figures of `count` sequences: the scene's extremes first, then space-filling samples of the trained
    box."""
    scene = get_scene(scene_name)
    if scene.schema.objects:
        raise InputError(
            f"{scene_name}: its parameters fill no box; see `python -m odeform_figures.studies.contact_study`"
        )
    measured, learned = measurements_of(scene_name), scene.schema.learned
    hidden = [p for p in learned if p.name in (measured.hidden or [q.name for q in learned])]
    settings = [*measured.extremes, *scene.sample(count, seed)][:count]
    jobs = [(p, scene.step) for p in settings] + [(p, 0.5 * scene.step) for p in settings]
    jobs += [(_nudge(p, q, by), scene.step) for p in settings for q in hidden for by in (-NUDGE, NUDGE)]
    motions = parallel_map(f"study {scene_name}", partial(_run, scene.simulate), jobs, workers)
    coarse, fine = motions[:count], motions[count : 2 * count]
    width = 2 * len(hidden)
    nudged = [motions[at : at + width] for at in range(2 * count, len(motions), width)]
    rows = [_row(measured, *given) for given in zip(settings, coarse, fine, nudged, strict=True)]
    figures = [key for key in rows[0] if key not in ("parameters", "seconds", "halving_rmse_mm")]
    return {
        "scene": scene_name,
        "command": f"python -m odeform_figures.studies.study {scene_name} --count {count} --seed {seed}",
        "step_ms": 1e3 * scene.step,
        "fixed": scene.fixed,
        "halving_rmse_mm": float(np.sqrt(np.mean([row["halving_rmse_mm"] ** 2 for row in rows]))),
        **{f"largest_{key}": max((row[key] for row in rows if row[key] is not None), default=None) for key in figures},
        "sequences": rows,
    }


def main() -> None:
    """Run the study from the command line."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.studies.study", description=__doc__)
    cores = os.cpu_count() or 1
    parser.add_argument("scene", metavar="SCENE", help=f"one of {', '.join(SCENES)}")
    parser.add_argument("--count", type=int, default=10, metavar="N", help="number of sequences (default: 10)")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="random seed of the parameters (default: 0)")
    parser.add_argument(
        "--workers", type=int, default=cores, metavar="W", help=f"number of processes (default: {cores}, one per core)"
    )
    parser.add_argument("--json", metavar="FILE", help="write the result to this file instead of printing it")
    args = parser.parse_args()
    for option in ("count", "workers"):
        if (value := getattr(args, option)) < 1:
            parser.error(f"--{option}: expected at least 1, got {value}")
    try:
        result = study(args.scene, args.count, args.seed, args.workers)
    except InputError as error:
        parser.error(str(error))
    write_or_print(result, args.json)


if __name__ == "__main__":
    main()
