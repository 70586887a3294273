"""What teaching a shape is worth: `python -m odeform_figures.studies.teaching FOLDER ... [--json FILE]`.

Each folder is one that `odeform simulate contact-force --geometry FILE --out FOLDER` wrote, beside the refined model
FOLDER.safetensors. Prints pooled errors in mm on the folder's test motions: of the first guess, of it without
deformation, of the nearest trained object's motion, of the refined model, and of the truth itself, with half the step.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

import odeform
from odeform.cli.entry import run_guarded
from odeform.dataset.index import Dataset
from odeform.models.base import Predictor
from odeform.simulation.scenes.contact_force import STEP, simulate_object
from odeform.simulation.user_data import body_in
from odeform.training.refine import first_guess
from odeform_figures.unseen.measure import measure
from odeform_figures.unseen.shapes import SCAN, UnseenShape

__all__ = ["main", "row"]

HALVED = 2  # test motions that are simulated again
COLUMNS = ("moved_mm", "model_mm", "rigid_mm", "nearest_mm", "refined_mm", "truth_mm")


def row(folder: Path, start: str) -> dict[str, Any]:
    """The errors of one taught body. `InputError` for a folder without motions or a model."""
    dataset, trained = odeform.open_dataset(folder), odeform.load(start)
    body = body_in(folder)
    assert body is not None
    refined = odeform.load(f"{folder}.safetensors")
    guess = first_guess(trained, body)
    shape = UnseenShape(body.item.name, SCAN, body.like, body.item, tuple(dataset.sequences("test")))
    found = measure(guess, trained, shape)
    made = refined.checkpoint.provenance
    return {
        "name": body.item.name,
        "like": body.like,
        "young_kpa": 1e-3 * body.item.material.young,
        "motions": len(shape.motions),
        **found.pooled,
        "refined_mm": _error_of(refined, shape),
        "truth_mm": _halved_step(dataset, body.item),
        "sequences": made["refined"]["sequences"],
        "seconds": made["training_seconds"],
    }


def _error_of(refined: Predictor, shape: UnseenShape) -> float:
    """mm: pooled RMSE of the refined model, as that of the other columns."""
    errors = []
    for truth in shape.motions:
        moved = refined.solve(None, truth.parameters, until=float(truth.times[-1])).vertices(truth.times)
        errors.append(np.square(moved[1:].astype(float) - truth.vertices[1:]).mean())
    return 1e3 * float(np.sqrt(np.mean(errors)))


def _halved_step(dataset: Dataset, item: Any) -> float:
    """mm: how far test motions are from those of half the step."""
    errors = []
    for entry in dataset.select("test")[:HALVED]:
        truth = dataset.read(entry)
        finer = simulate_object(item, entry.parameters, round(1.0 / (truth.times[1] - truth.times[0])), 0.5 * STEP)
        errors.append(np.square(finer.vertices[1:].astype(float) - truth.vertices[1:]).mean())
    return 1e3 * float(np.sqrt(np.mean(errors)))


def main() -> int:
    """Print the table; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.studies.teaching", description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path, metavar="FOLDER")
    parser.add_argument("--from", dest="start", default="contact-force", metavar="CKPT")
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()

    def work() -> None:
        rows = []
        print(
            "| | like | displacement | first guess | rigid | nearest object | refined | truth, half the step | ratio |"
        )
        print("|---|---|---|---|---|---|---|---|---|")
        for folder in args.folders:
            found = row(folder, args.start)
            rows.append(found)
            values = " | ".join(f"{found[name]:.2f}" for name in COLUMNS)
            ratio = found["refined_mm"] / found["model_mm"]
            print(f"| {found['name']} | {found['like']} | {values} | {ratio:.2f} |", flush=True)
        if args.json:
            Path(args.json).write_text(json.dumps(rows, indent=1))

    return run_guarded(work)


if __name__ == "__main__":
    raise SystemExit(main())
