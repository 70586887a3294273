"""Whether bodies still move at the end of a load in the simulation, too: the draws of `odeform stress`, simulated.

Run `python -m odeform_figures.studies.at_rest slope wall --draws 7`. A simulation of 2 s takes minutes; with `--keep
FOLDER` they are used again.
"""

import argparse
import hashlib
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.models.per_object import PerObject
from odeform.models.registry import load
from odeform.motion.base import Motion
from odeform.motion.recorded import RecordedMotion
from odeform.motion.rest import rests_from
from odeform.schema import OBJECT, Parameters
from odeform.simulation.errors import SimulationError
from odeform.simulation.scenes.registry import get_scene
from odeform.stress.objects import draws_of, end_of, with_body
from odeform.types import MotionSequence
from odeform_figures.output import write_or_print

__all__ = ["compare", "simulated", "speed_at"]

LAST = 0.05  # s, over which a speed is measured


def simulated(scene: str, parameters: Parameters, until: float, keep: Path | None = None) -> MotionSequence | None:
    """One motion of a scene to `until` s, or until the body rests; None where the simulation fails. One that is in the
    folder `keep` is read from it."""
    digest = hashlib.sha256(json.dumps([scene, dict(parameters), until], sort_keys=True).encode()).hexdigest()[:16]
    path = None if keep is None else keep / f"{scene}_{parameters[OBJECT]}_{digest}.npz"
    if path is not None and path.exists():
        with np.load(path, allow_pickle=False) as file:
            return MotionSequence(file["times"], file["vertices"], file["faces"], file["weights"], dict(parameters))
    try:
        found = get_scene(scene).simulate(parameters, until=until)
    except SimulationError:
        return None
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        named = {name: getattr(found, name) for name in ("times", "vertices", "faces", "weights")}
        np.savez(path, **named)
    return found


def speed_at(motion: Motion | RecordedMotion, until: float) -> float:
    """m/s: how fast the fastest point is in the mean of the `LAST` seconds before `until`."""
    before, after = motion.vertices(np.array([until - LAST, until])).astype(float)
    return float(np.linalg.norm(after - before, axis=1).max()) / LAST


def _row(motion: Motion | RecordedMotion, until: float) -> dict[str, Any]:
    return {"rests": rests_from(motion, until) is not None, "mm_per_s": round(1e3 * speed_at(motion, until), 2)}


def compare(
    checkpoint: str,
    draws: int,
    seed: int = 0,
    keep: Path | None = None,
    moving: bool = False,
) -> dict[str, Any]:
    """The draws with which `odeform stress --draws N` stresses a model of objects under a load: how many still move at
    the end, in the model and in the simulation, by one criterion, and how fast. Of those that are `moving` in the model
    only, where that is given."""
    model = load(checkpoint)
    if not isinstance(model, PerObject):
        raise InputError(f"{checkpoint}: expected a model of objects, as contact-force:slope")
    rows, until = [], end_of(model.schema.window)
    for index, drawn in enumerate(draws_of(model.schema, draws, seed)):
        parameters = with_body(model, index, drawn)
        predicted = _row(model.solve(parameters=parameters), until)
        if moving and predicted["rests"]:
            continue
        found = simulated(model.schema.scene, parameters, until, keep)
        if found is None:
            continue
        true = _row(RecordedMotion(model.schema, found), until)
        rows.append({"draw": index, "object": drawn[OBJECT], "model": predicted, "simulation": true})
        print(rows[-1], file=sys.stderr, flush=True)
    return {
        "simulated": len(rows),
        "move": {key: sum(not row[key]["rests"] for row in rows) for key in ("model", "simulation")},
        "agree": sum(row["model"]["rests"] == row["simulation"]["rests"] for row in rows),
        "rows": rows,
    }


def main() -> None:
    """Simulate, compare, and print."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.studies.at_rest", description=__doc__)
    parser.add_argument("loads", nargs="+", metavar="LOAD", help="as slope")
    parser.add_argument("--draws", type=int, default=7, help="of each load (default: 7, one of each object)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--moving", action="store_true", help="only those that still move in the model")
    parser.add_argument("--keep", type=Path, help="folder that keeps the simulations")
    parser.add_argument("--json", type=Path, help="write figures to this file")
    args = parser.parse_args()
    found = {
        name: compare(f"contact-force:{name}", args.draws, args.seed, args.keep, args.moving) for name in args.loads
    }
    write_or_print(found, args.json)


if __name__ == "__main__":
    main()
