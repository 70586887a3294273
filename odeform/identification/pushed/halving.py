"""How many pushes halve what is open about a drawn body: the proposed ones against random ones."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from odeform.identification.pushed.drawn import drawn_states, forward_of
from odeform.identification.pushed.experiment import candidates, until_halved, widest
from odeform.identification.pushed.identify import model_errors
from odeform.identification.pushed.search import PRIOR
from odeform.identification.pushed.state import BODY
from odeform.models.base import Predictor
from odeform.progress import Progress
from odeform.schema import OBJECT

__all__ = ["halve_drawn", "report_halved"]

ORDERS = 50  # of random pushes, for each body


def halve_drawn(
    predictor: Predictor, objects: Sequence[str], count: int, noise_mm: float = 2.0, seed: int = 0
) -> dict[str, Any]:
    """Counts pushes until the widest interval is half as wide, after one random push, on `count` bodies of each object.

    Counts follow from linearised posteriors at the drawn body, with the model's own error.
    """
    rows, rng = [], np.random.default_rng(seed)
    progress = Progress("next pushes", count * len(objects))
    for name in objects:
        forward, forces = forward_of(predictor, name), predictor.force_range({OBJECT: name})
        errors = model_errors(predictor, {OBJECT: name}, forward.times)
        for index, state in enumerate(drawn_states(predictor, name, count, seed)):
            pushes = candidates(forward, state.body, forces, noise_mm, errors, seed + index)
            orders = [rng.permutation(len(pushes.states)) for _ in range(ORDERS)]
            first = np.linalg.inv(np.eye(len(BODY)) / PRIOR**2 + pushes.informations[orders[0][0]])
            random = [until_halved(pushes, first, [int(one) for one in order]) for order in orders]
            proposed = until_halved(pushes, first, None)
            rows.append({"object": name, "before": widest(first), "proposed": proposed, "random": np.mean(random)})
            progress.advance(1)
    progress.close()
    return {"noise_mm": noise_mm, "bodies": len(rows), "rows": rows}


def report_halved(result: dict[str, Any]) -> str:
    """Returns the counts in three lines."""
    proposed, random = (np.array([row[key] for row in result["rows"]], dtype=float) for key in ("proposed", "random"))
    return "\n".join(
        [
            f"{result['bodies']} bodies, points with {result['noise_mm']:g} mm of noise: pushes until the widest "
            "interval is half as wide",
            f"proposed: {proposed.mean():.1f} on average, at most two for {np.mean(proposed <= 2):.0%}",
            f"random: {random.mean():.1f} on average, {np.median(random / proposed):.1f} times as many (median)",
        ]
    )
