"""How far the model's errors lead from the true body, in experiments that the simulator makes."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.identification.discrepancy import TWO_SIDED
from odeform.identification.pushed.drawn import drawn_states, forward_of
from odeform.identification.pushed.identify import model_errors
from odeform.identification.pushed.linearised import linearised
from odeform.identification.pushed.search import PRIOR
from odeform.identification.pushed.simulator import experiment_simulator
from odeform.identification.pushed.state import BODY, FRICTION
from odeform.identification.pushed.table import NOMINAL, TINY
from odeform.identification.pushed.trials import Falls, Pushes, Trials
from odeform.loads.measured import FALLS
from odeform.loads.registry import get_load
from odeform.models.base import Predictor
from odeform.models.conformal import conformal_factor
from odeform.progress import Progress
from odeform.schema import OBJECT
from odeform.simulation.errors import SimulationError

__all__ = ["misled_drawn", "report_misled"]


def misled_drawn(
    predictor: Predictor, objects: Sequence[str], count: int, noise_mm: float = 0.0, seed: int = 0
) -> dict[str, Any]:
    """Simulates a push, a drop and a throw of `count` drawn bodies of each object, and compares where each leads, from
    the true body and by linearised motions, with how far it should at most. Bodies that cannot be simulated are left
    out."""
    rows: list[dict[str, Any]] = []
    progress = Progress("simulated", count * len(objects))
    for name in objects:
        forward, forces = forward_of(predictor, name), predictor.force_range({OBJECT: name})
        errors, simulate = model_errors(predictor, {OBJECT: name}, forward.times), experiment_simulator(forward, name)
        for index, state in enumerate(drawn_states(predictor, name, count, seed)):
            every: list[Trials] = [
                Pushes(forward, [state.body], forces, errors, 1, seed + index),
                *(Falls(forward, state.body, get_load(load), 1, seed + index) for load in FALLS),
            ]
            for trials in (one for one in every if one.experiments):
                experiment = trials.experiments[0]
                try:
                    seen = simulate(experiment, state.value(FRICTION), trials.times[0])
                except SimulationError:
                    continue
                found = linearised(forward, trials, state.body, noise_mm, observed=[seen])
                covariance = np.linalg.inv(found.informations[0] + np.eye(len(BODY)) / PRIOR**2)
                off, expected = covariance @ found.scores[0], np.sqrt(np.diag(covariance))
                rows.append(
                    {"object": name, "load": experiment.load, "off": off.tolist(), "expected": expected.tolist()}
                )
            progress.advance(1)
    progress.close()
    if not rows:
        raise InputError("identify: expected a body that can be simulated; none of those drawn could")
    loads = dict.fromkeys(row["load"] for row in rows)
    return {"noise_mm": noise_mm, "rows": rows, "loads": {load: _scores(rows, load) for load in loads}}


def _scores(rows: Sequence[dict[str, Any]], load: str) -> dict[str, Any]:
    own = [row for row in rows if row["load"] == load]
    ratios = np.abs([np.array(row["off"]) / row["expected"] for row in own]).ravel()
    return {
        "experiments": len(own),
        "median": float(np.median(ratios)),
        "factor_90": conformal_factor(np.log(np.maximum(ratios / TWO_SIDED, TINY)), NOMINAL),
    }


def report_misled(result: dict[str, Any]) -> str:
    """Returns a line for each load."""
    lines = ["where one simulated experiment leads from the true body, in standard deviations of its posterior"]
    for load, one in result["loads"].items():
        factor = one["factor_90"]
        wide = "" if factor is None else f"; intervals {factor:.1f} times as wide would hold nine in ten"
        lines.append(f"{load:<8}{one['experiments']:>4} experiments, median {one['median']:.1f}{wide}")
    return "\n".join(lines)
