"""Shapes that no model was trained on, under loads: errors beside those of a rigid body and of the seven objects.

`python -m odeform_figures.studies.unseen_loads --keep DIR [FILE ...]` drops, throws and kicks other instances of the
seven classes, and the shapes in files, in the simulator, and measures the model on that. What `DIR` holds is not
simulated again.
"""

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.loads.registry import get_load
from odeform.models.base import Predictor
from odeform.models.modal.training.impact_fit import impacts_of
from odeform.models.modal.user_body import UserBodyPredictor, resting_body
from odeform.models.registry import load
from odeform.schema import OBJECT
from odeform.simulation.objects.user_object import UserObject, read_user_object, write_user_object
from odeform.simulation.user_data import body_in, digest, simulate_item
from odeform_figures.output import write_or_print
from odeform_figures.studies.loads import errors_of
from odeform_figures.unseen.instances import EXTREMES, factors_of
from odeform_figures.unseen.shapes import UnseenShape, instance, scan

__all__ = ["compared", "means", "measured", "table"]

LOADS = ("drop", "throw", "kick")
INSTANCES = ("bottle-moderate", "dog-extreme", "donut-extreme", "pillow-moderate")
SEEN = Path("assets/studies/loads.json")
SPLITS = ("train", "val", "test")
ERRORS = ("first_120_ms", "whole")
MEANS = (("mean", "unseen"), ("mean of the seven", "seven"), ("mean of what they are like", "like"))


def makers(instances: Sequence[str], files: Sequence[Path]) -> dict[str, Callable[[], UnseenShape]]:
    """What makes each shape, by its name. `InputError` for an instance that there is not."""
    found: dict[str, Callable[[], UnseenShape]] = {}
    for key in instances:
        name = key.rpartition("-")[0]
        factors = factors_of(name).get(key) if name in EXTREMES else None
        if factors is None:
            raise InputError(f"instance {key!r}: expected a class and which, as in {INSTANCES[0]}")
        found[key] = partial(instance, key, name, factors)
    return found | {path.stem: partial(scan, path) for path in files}


def simulated(
    make: Callable[[], UnseenShape], name: str, keep: Path, count: int, seed: int, workers: int
) -> dict[str, Dataset]:
    """The motions of a shape under each load, from the folder `keep`, or simulated into it."""
    body, settings = _kept(make, keep / name), {"count": count, "seed": seed, "workers": workers}
    return {
        acting: simulate_item(f"object-{acting}", body.item, body.like, keep / f"{name}-{acting}", **settings)
        for acting in LOADS
    }


def _kept(make: Callable[[], UnseenShape], folder: Path) -> UserObject:
    """The body of a shape as a folder keeps it: made anew, it would have slightly other tetrahedra."""
    if (kept := read_user_object(folder)) is not None:
        return kept
    shape = make()
    write_user_object(folder, UserObject(shape.item, shape.like, digest(shape.item)))
    kept = read_user_object(folder)
    assert kept is not None
    return kept


def measured(trained: Predictor, dataset: Dataset, acting: str) -> dict[str, Any]:
    """The errors of a model on the motions of a folder under a load, relative to the displacement since the first
    contact; what is absent could not be simulated."""
    body = body_in(dataset.root)
    assert body is not None
    motions = [motion for split in SPLITS for motion in dataset.sequences(split)]
    # a shape of one's own has no name that a model knows
    found = [replace(one, parameters={k: v for k, v in one.parameters.items() if k != OBJECT}) for one in motions]
    impacts = impacts_of(found, dataset.schema.window.rate, get_load(acting))
    model = UserBodyPredictor(trained.under(acting), resting_body(body.item, body.like))
    return {"like": body.like, "distance": round(model.distance, 3), **errors_of(model, impacts)}


def means(rows: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """Means over shapes of the errors of the model and of a rigid body."""
    return {
        key: {error: round(float(np.mean([row[key][error] for row in rows.values()])), 4) for error in ERRORS}
        for key in ("model", "rigid")
    }


def compared(rows: Mapping[str, Mapping[str, Any]], seen: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Means over shapes that were never seen, over the seven objects, and over those of them that each shape is like,
    and how many times the errors of the latter two the former's are."""
    new, old = means(rows), means(seen)
    like = means({name: seen[row["like"]] for name, row in rows.items()})
    better = sum(row["model"]["whole"] < row["rigid"]["whole"] for row in rows.values())
    return {
        "unseen": new,
        "seven": old,
        "like": like,
        "ratio": _ratio(new, old),
        "ratio_like": _ratio(new, like),
        "better_than_rigid": better,
        "shapes": len(rows),
    }


def _ratio(new: Mapping[str, Mapping[str, float]], old: Mapping[str, Mapping[str, float]]) -> dict[str, float]:
    return {error: round(new["model"][error] / old["model"][error], 2) for error in ERRORS}


def table(result: Mapping[str, Any]) -> str:
    """The table of the docs."""
    lines = [
        "| | like | motions | first 120 ms | rigid | until 0.8 s (kicks 0.5 s) | rigid | place | orientation |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for acting, found in result.items():
        for name, row in found["shapes"].items():
            cells = [f"{acting}, {name}", row["like"], str(row["motions"]), *_percent(row)]
            model = row["model"]
            lines.append(_line([*cells, f"{model['place_mm']:.0f} mm", f"{model['turn_deg']:.0f}°"]))
        means_of = found["means"]
        for title, key in MEANS:
            lines.append(_line([f"**{acting}, {title}**", "", "", *_percent(means_of[key], "**"), "", ""]))
        for title, key in (("the seven's", "ratio"), ("those of what they are like", "ratio_like")):
            lines.append(_line([f"{acting}, times {title}", "", "", *_ratios(means_of[key]), "", ""]))
    return "\n".join(lines)


def _percent(row: Mapping[str, Any], bold: str = "") -> list[str]:
    return [
        f"{mark}{100.0 * row[key][error]:.0f} %{mark}"
        for error in ERRORS
        for key, mark in (("model", bold), ("rigid", ""))
    ]


def _ratios(ratio: Mapping[str, float]) -> list[str]:
    return [cell for error in ERRORS for cell in (f"{ratio[error]:.2f}", "")]


def _line(cells: Sequence[str]) -> str:
    return "|" + "".join(f" {cell} |" if cell else " |" for cell in cells)


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.studies.unseen_loads", description=__doc__)
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="meshes, points or splats")
    parser.add_argument("--instance", nargs="*", default=INSTANCES, help="CLASS-moderate or CLASS-extreme")
    parser.add_argument("--keep", type=Path, required=True, metavar="DIR", help="folder of simulated motions")
    parser.add_argument("--checkpoint", default="contact-force")
    parser.add_argument("--count", type=int, default=3, help="motions of each shape under each load (3)")
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--workers", type=int, default=1, help="processes (1)")
    parser.add_argument("--out", type=Path, metavar="FILE.json")
    args = parser.parse_args()
    trained, seen = load(args.checkpoint), json.loads(SEEN.read_text())
    result: dict[str, Any] = {acting: {"shapes": {}} for acting in LOADS}
    for name, make in makers(args.instance, args.files).items():
        for acting, dataset in simulated(make, name, args.keep, args.count, args.seed, args.workers).items():
            result[acting]["shapes"][name] = measured(trained, dataset, acting)
    for acting, found in result.items():
        found["means"] = compared(found["shapes"], seen[f"{acting}s"])
    print(table(result))
    if args.out:
        write_or_print(result, args.out)


if __name__ == "__main__":
    main()
