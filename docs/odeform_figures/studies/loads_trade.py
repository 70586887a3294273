"""What accuracy costs under loads: processor time and solver error of new motions, by the tolerance of their steps.

Run `python -m odeform_figures.studies.loads_trade drop throw`.
"""

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from odeform.benchmark.timing import as_viewed
from odeform.models.base import Predictor
from odeform.models.modal.model import QUALITIES
from odeform.models.registry import load
from odeform.schema import Parameters
from odeform.simulation.scenes.registry import get_scene
from odeform.solver.integrate import SolverSettings
from odeform.types import Frames
from odeform_figures.output import write_or_print

__all__ = ["traded"]

TOLERANCES = (7e-5, 1.5e-4, 2.5e-4, 4e-4, 6e-4)
SEED = 3


def traded(
    checkpoint: str,
    acting: str,
    objects: Sequence[str],
    draws: int,
    tolerances: Sequence[float] = TOLERANCES,
    reference: SolverSettings = QUALITIES["reference"],
) -> list[dict[str, Any]]:
    """One row for each tolerance: ms of processor time of a new motion with a frame at its end, mean over `draws` of
    each object; and the RMS distance from that of `reference` over the window, relative to the RMS displacement."""
    model = load(checkpoint).under(acting)
    drawn = [one for name in objects for one in get_scene(model.schema.scene).sample(draws, SEED, [name])]
    rows = []
    with as_viewed():
        sure = [_frames(model, one, reference) for one in drawn]
        for tolerance in tolerances:
            settings = replace(QUALITIES["balanced"], tolerance=tolerance)
            begin = time.process_time()
            for one in drawn:
                model.solve(parameters=one, quality=settings).vertices(model.schema.window.stop)
            taken = 1e3 * (time.process_time() - begin) / len(drawn)
            errors = [_off(_frames(model, one, settings), truth) for one, truth in zip(drawn, sure, strict=True)]
            off = {name: float(at(errors)) for name, at in (("median", np.median), ("mean", np.mean), ("most", np.max))}
            rows.append({"tolerance": tolerance, "ms": round(taken, 1), **{k: round(v, 4) for k, v in off.items()}})
    return rows


def _frames(model: Predictor, parameters: Parameters, settings: SolverSettings) -> Frames:
    """(T, N, 3) m at the frames of the window."""
    return model.solve(parameters=parameters, quality=settings).vertices(model.schema.window.times).astype(float)


def _off(points: Frames, truth: Frames) -> float:
    return float(np.sqrt(((points - truth) ** 2).mean() / ((truth - truth[0]) ** 2).mean()))


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.studies.loads_trade", description=__doc__)
    parser.add_argument("load", nargs="+", help="loads, such as drop")
    parser.add_argument("--checkpoint", default="contact-force", metavar="CKPT")
    parser.add_argument("--object", nargs="+", help="objects (default: all)")
    parser.add_argument("--draws", type=int, default=5, metavar="N", help="motions of each (default: 5)")
    parser.add_argument("--json", metavar="FILE", help="write the result to this file instead of printing it")
    args = parser.parse_args()
    objects = args.object or load(args.checkpoint).schema.objects
    write_or_print({name: traded(args.checkpoint, name, objects, args.draws) for name in args.load}, args.json)


if __name__ == "__main__":
    main()
