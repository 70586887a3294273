"""What the time of a new push consists of, at each quality: `python -m odeform_figures.speed.phases`.

Of each phase the least of several rounds over the same pushes, which other work on the machine disturbs least; in each
round every push is new to the model.
"""

import argparse
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from odeform.benchmark.timing import as_viewed
from odeform.dataset.store import open_dataset
from odeform.models.per_object import PerObject
from odeform.models.registry import load
from odeform.types import Floats, MotionSequence
from odeform_figures.output import write_or_print

__all__ = ["PHASES", "phases"]

PHASES = ("prepared", "steps", "first_frame", "other_frames", "read_again")
"""Contact, directions around it and regression; the steps of the solver; the first frame, for which the floor is looked
at; all frames of the window, which are checked; the same frames again."""
FIRST = 0.03  # s: a frame in the middle of the push


def phases(predictor: PerObject, truths: Sequence[MotionSequence], quality: str, rounds: int) -> dict[str, float]:
    """Medians over pushes (two at least) of the milliseconds of each of `PHASES`, and of the steps of the solver."""
    found = [[_push(predictor, truth, quality) for truth in truths] for _ in range(rounds + 1)]
    least = np.min(found[1:], axis=0)  # the first round compiles, and computes what is kept
    return dict(zip((*PHASES, "number_of_steps"), np.median(least, axis=0).round(2).tolist(), strict=True))


def _push(predictor: PerObject, truth: MotionSequence, quality: str) -> Floats:
    """(6,) the phases of one push, and its number of steps."""
    marks = [time.perf_counter()]
    motion = predictor.solve(None, truth.parameters, quality)
    marks.append(time.perf_counter())
    for times in (FIRST, truth.times, truth.times):
        motion.vertices(times)
        marks.append(time.perf_counter())
    solved, *read = 1e3 * np.diff(marks)
    steps = motion.stats.wall_ms
    return np.array([solved - steps, steps, *read, motion.stats.steps])


def main() -> None:
    """Measure the bundled model of pushed objects."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.speed.phases", description=__doc__)
    parser.add_argument("--object", nargs="+", help="objects (default: all)")
    parser.add_argument("--count", type=int, default=12, help="pushes of the test split of each object (default: 12)")
    parser.add_argument("--rounds", type=int, default=7, help="rounds of which the least counts (default: 7)")
    parser.add_argument("--json", help="write figures to this file")
    args = parser.parse_args()
    predictor, dataset, out = load("contact-force"), open_dataset("contact-force"), dict[str, Any]()
    assert isinstance(predictor, PerObject)
    with as_viewed():
        for name in args.object or predictor.schema.objects:
            truths = list(dataset.sequences("test", name))[: args.count]
            out[name] = {quality: phases(predictor, truths, quality, args.rounds) for quality in predictor.qualities}
    write_or_print(out, args.json)


if __name__ == "__main__":
    main()
