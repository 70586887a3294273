"""Vertices that training does not see: `python -m odeform_figures.unseen.vertices`.

A tenth of the vertices of each object is held out: in training they have no weight. The model moves them as it moves
all points of a body, and its error there is compared with that at the others.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from odeform.dataset.index import Dataset, Entry
from odeform.dataset.store import open_dataset
from odeform.models.base import Predictor
from odeform.training.train import train
from odeform.types import Bools, MotionSequence
from odeform_figures.output import write_or_print

__all__ = ["errors_at", "held_out", "main", "without_vertices"]

FRACTION = 0.1


def held_out(count: int, fraction: float, seed: int) -> Bools:
    """(N,) which of `count` vertices are held out, at random."""
    chosen = np.zeros(count, dtype=bool)
    chosen[np.random.default_rng(seed).permutation(count)[: round(fraction * count)]] = True
    return chosen


def without_vertices(dataset: Dataset, fraction: float, seed: int) -> Dataset:
    """Returns the same motions, in which a fraction of the vertices has no weight: the same ones in all motions of a
    body."""

    def read(entry: Entry) -> MotionSequence:
        sequence = dataset.read(entry)
        seen = ~held_out(len(sequence.weights), fraction, seed)
        weights = np.where(seen, sequence.weights, 0.0)
        return replace(sequence, weights=(weights / weights.sum()).astype(sequence.weights.dtype))

    return replace(dataset, read=read)


def errors_at(predictor: Predictor, dataset: Dataset, fraction: float, seed: int) -> dict[str, dict[str, float]]:
    """Pooled RMSE in mm on the test split, at vertices that were held out and at the others, and their ratio, for each
    object."""
    window = dataset.schema.window
    out: dict[str, dict[str, float]] = {}
    for name in dataset.objects:
        squares: list[list[float]] = []
        for recorded in dataset.sequences("test", name):
            truth = recorded.frames(window.stop, window.rate)
            predicted = predictor.solve(None, truth.parameters).vertices(truth.times)
            error = np.square(predicted.astype(float) - truth.vertices)[1:].mean(axis=(0, 2))
            hidden = held_out(len(error), fraction, seed)
            squares.append([float(error[hidden].mean()), float(error[~hidden].mean())])
        there, elsewhere = 1e3 * np.sqrt(np.mean(squares, axis=0))
        out[name] = {"held_out_mm": float(there), "others_mm": float(elsewhere), "ratio": float(there / elsewhere)}
    return out


def _study(dataset: Dataset, seed: int) -> dict[str, Any]:
    with tempfile.TemporaryDirectory(prefix="odeform-") as folder:
        predictor = train(without_vertices(dataset, FRACTION, seed), Path(folder) / "model.safetensors", seed=seed)
        objects = errors_at(predictor, dataset, FRACTION, seed)
    keys = ("held_out_mm", "others_mm", "ratio")
    mean = {key: float(np.mean([one[key] for one in objects.values()])) for key in keys}
    command = f"python -m odeform_figures.unseen.vertices --seed {seed}"
    return {"command": command, "share": FRACTION, "objects": objects, "mean": mean}


def main(argv: list[str] | None = None) -> None:
    """Train without a tenth of the vertices and print their errors, or write them to a file."""
    parser = argparse.ArgumentParser("python -m odeform_figures.unseen.vertices", description=__doc__)
    parser.add_argument("--data", default="contact-force", metavar="DATASET", help="default: contact-force")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of the choice of vertices (default: 0)")
    parser.add_argument(
        "--json", type=Path, metavar="FILE", help="write the result to this file instead of printing it"
    )
    args = parser.parse_args(argv)
    write_or_print(_study(open_dataset(args.data), args.seed), args.json)


if __name__ == "__main__":
    main()
