"""How many experiments halve what is open about a drawn body: proposed ones against random ones, and pushes alone."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from odeform.identification.pushed.candidates import candidates
from odeform.identification.pushed.drawn import drawn_states, forward_of
from odeform.identification.pushed.experiment import Candidates, until_halved, widest
from odeform.identification.pushed.identify import model_errors
from odeform.identification.pushed.search import PRIOR
from odeform.identification.pushed.state import BODY
from odeform.loads.registry import PUSH
from odeform.models.base import Predictor
from odeform.progress import Progress
from odeform.schema import OBJECT

__all__ = ["halve_drawn", "report_halved"]

ORDERS = 50  # of random experiments, for each body
PUSHES = "pushes"


def halve_drawn(
    predictor: Predictor, objects: Sequence[str], count: int, noise_mm: float = 2.0, seed: int = 0
) -> dict[str, Any]:
    """Counts experiments until the widest interval is half as wide, after one random push, on `count` bodies of each
    object.

    Counts follow from linearised posteriors at the drawn body, with the model's own error.
    """
    rows, rng = [], np.random.default_rng(seed)
    progress = Progress("next experiments", count * len(objects))
    for name in objects:
        forward, forces = forward_of(predictor, name), predictor.force_range({OBJECT: name})
        errors = model_errors(predictor, {OBJECT: name}, forward.times)
        for index, state in enumerate(drawn_states(predictor, name, count, seed)):
            found = candidates(forward, state.body, forces, noise_mm, errors, seed + index)
            pushes = found.under(PUSH)
            first = np.linalg.inv(
                np.eye(len(BODY)) / PRIOR**2 + pushes.informations[rng.integers(len(pushes.experiments))]
            )
            counted, alone = _counted(found, first, rng), _counted(pushes, first, rng)
            rows.append({"object": name, "before": widest(first), **counted, PUSHES: alone})
            progress.advance(1)
    progress.close()
    return {"noise_mm": noise_mm, "bodies": len(rows), "rows": rows}


def _counted(found: Candidates, first: Float[np.ndarray, "body body"], rng: np.random.Generator) -> dict[str, Any]:
    """How many of the proposed experiments, and of random ones on average, and which loads were proposed."""
    orders = [rng.permutation(len(found.experiments)).tolist() for _ in range(ORDERS)]
    made = until_halved(found, first)
    return {
        "proposed": len(made),
        "loads": [found.experiments[index].load for index in made],
        "random": float(np.mean([len(until_halved(found, first, order)) for order in orders])),
    }


def report_halved(result: dict[str, Any]) -> str:
    """Returns the counts in a few lines, those of pushes alone last."""
    rows = result["rows"]
    loads = Counter(load for row in rows for load in row["loads"])
    return "\n".join(
        [
            f"{result['bodies']} bodies, points with {result['noise_mm']:g} mm of noise: experiments until the widest "
            "interval is half as wide",
            f"of all loads: {_means(rows)}",
            f"which were proposed: {', '.join(f'{count} times {load}' for load, count in loads.most_common())}",
            f"of pushes alone: {_means([row[PUSHES] for row in rows])}",
        ]
    )


def _means(rows: Sequence[dict[str, Any]]) -> str:
    proposed, random = (np.array([row[key] for row in rows], dtype=float) for key in ("proposed", "random"))
    return (
        f"proposed {proposed.mean():.1f} on average, at most two for {np.mean(proposed <= 2):.0%}; "
        f"random {random.mean():.1f} on average, {np.median(random / proposed):.1f} times as many (median)"
    )
