"""Which step does a pushed object need? `python -m odeform_figures.studies.steps OBJECT ...` halves it twice.

Prints JSON: how much the displacement changes when the declared step is halved and halved again, and what each of the
simulations takes. The pushes are those of `odeform_figures.studies.contact_study` with the same count and seed. The
shipped figures are in `assets/studies/steps.json`.
"""

import argparse
import os
import time
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from odeform.parallel import parallel_map
from odeform.schema import OBJECT, Parameters
from odeform.simulation.errors import SimulationError
from odeform.simulation.objects.catalog import OBJECTS
from odeform.simulation.scenes.contact_force import SCENE, simulate
from odeform.types import Floats
from odeform_figures.output import write_or_print

__all__ = ["main", "steps"]

FACTORS = (1.0, 0.5, 0.25)
"""Steps, as fractions of the declared one."""

Simulated = tuple[Floats, float] | str
"""(T, N, 3) m and seconds of processor time; or why there is no motion."""


def steps(names: Sequence[str], count: int, seed: int, workers: int, skip: int = 0) -> dict[str, Any]:
    """The figures of `count` pushes of each of the objects `names`, drawn as for a data set with this seed, without the
    first `skip` of them."""
    settings = [parameters for name in names for parameters in SCENE.sample(count, seed, [name])[skip:]]
    jobs = [(parameters, factor * SCENE.step) for parameters in settings for factor in FACTORS]
    motions = parallel_map("steps of contact-force", _run, jobs, workers)
    width = len(FACTORS)
    rows = [_row(parameters, motions[width * at : width * (at + 1)]) for at, parameters in enumerate(settings)]
    return {
        "command": f"python -m odeform_figures.studies.steps {' '.join(names)} --count {count} --seed {seed}"
        + (f" --skip {skip}" if skip else ""),
        "steps_ms": [1e3 * factor * SCENE.step for factor in FACTORS],
        "objects": {name: _pooled([row for row in rows if row["parameters"][OBJECT] == name]) for name in names},
        "pushes": rows,
    }


def _run(job: tuple[Parameters, float]) -> Simulated:
    parameters, step = job
    begin = time.process_time()
    try:
        return simulate(parameters, step=step).vertices.astype(float), time.process_time() - begin
    except SimulationError as error:
        return str(error)


def _row(parameters: Parameters, motions: list[Simulated]) -> dict[str, Any]:
    """The figures of one push; `failed` is the first reason, if one of its motions is not sound."""
    sound = [motion for motion in motions if not isinstance(motion, str)]
    if len(sound) < len(motions):
        return {"parameters": dict(parameters), "failed": next(m for m in motions if isinstance(m, str))}
    return {
        "parameters": dict(parameters),
        "displacement_mm": _rms_mm(sound[-1][0] - sound[-1][0][0]),
        "halved_mm": [_rms_mm(coarse[0] - fine[0]) for coarse, fine in pairwise(sound)],
        "processor_s": [seconds for _, seconds in sound],
    }


def _rms_mm(difference: Floats) -> float:
    return 1e3 * float(np.sqrt((difference**2).sum(axis=-1).mean()))


def _pooled(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """The figures of one object: RMS changes relative to the RMS displacement, by the step that is halved."""
    sound = [row for row in rows if "failed" not in row]
    if not sound:
        return {"failed": len(rows)}
    displacement = float(np.sqrt(np.mean([row["displacement_mm"] ** 2 for row in sound])))
    changes = np.sqrt(np.mean(np.square([row["halved_mm"] for row in sound]), axis=0))
    seconds = np.mean([row["processor_s"] for row in sound], axis=0)
    return {
        "failed": len(rows) - len(sound),
        "displacement_mm": displacement,
        "halved": [float(change) / displacement for change in changes],
        "processor_s": [float(each) for each in seconds],
    }


def main(argv: list[str] | None = None) -> None:
    """Run the study from the command line."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.studies.steps", description=__doc__)
    parser.add_argument("objects", nargs="*", metavar="OBJECT", help=f"of {', '.join(OBJECTS)} (default: all)")
    parser.add_argument("--count", type=int, default=6, metavar="N", help="pushes of each object (default: 6)")
    parser.add_argument("--skip", type=int, default=0, metavar="N", help="leave out the first N of them (default: 0)")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="random seed of the parameters (default: 0)")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="W", help="number of processes")
    parser.add_argument("--json", metavar="FILE", help="write the result to this file instead of printing it")
    args = parser.parse_args(argv)
    for option in ("count", "workers"):
        if (value := getattr(args, option)) < 1:
            parser.error(f"--{option}: expected at least 1, got {value}")
    if not 0 <= args.skip < args.count:
        parser.error(f"--skip: expected at least 0 and less than --count, got {args.skip}")
    names = args.objects or list(OBJECTS)
    if unknown := [name for name in names if name not in OBJECTS]:
        parser.error(f"{', '.join(unknown)}: expected objects, {', '.join(OBJECTS)}")
    write_or_print(steps(names, args.count, args.seed, args.workers, args.skip), args.json)


if __name__ == "__main__":
    main()
