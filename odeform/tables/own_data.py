"""Small data sets of several kinds, trained with default settings: `python -m odeform.tables.own_data --keep DIR`."""

import argparse
import json
import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from odeform.dataset.importers.registry import import_dataset
from odeform.dataset.store import open_dataset
from odeform.io import atomic_write
from odeform.synthetic.motions.folder import write_folder
from odeform.synthetic.motions.registry import KINDS
from odeform.training.train import print_line, train

__all__ = ["main", "measure", "summary"]

MODELS = ("odeform", "gp", "pod-rbf", "nearest")
SCORES = ("rmse_pooled_mm", "deformation_relative", "sequences")

Scores = dict[str, dict[str, Any]]


def measure(dataset: Path, keep: Path, minutes: float) -> Scores:
    """Scores on the test split by model, from `keep/NAME_MODEL.safetensors`, which is trained where it is missing."""
    found: Scores = {}
    for model in MODELS:
        out = keep / f"{dataset.name}_{model}.json"
        if not out.exists():
            predictor = train(open_dataset(dataset), out.with_suffix(".safetensors"), model, minutes=minutes)
            checkpoint = predictor.checkpoint
            scores = {name: checkpoint.scores[name] for name in SCORES}
            taken = {"seconds": checkpoint.provenance["training_seconds"], "command": checkpoint.provenance["command"]}
            share = {"correction": checkpoint.config.get("correction")}
            atomic_write(out, json.dumps({**scores, **taken, **share}, indent=1).encode())
        found[model] = json.loads(out.read_text())
    return found


def summary(found: Mapping[str, Scores]) -> list[str]:
    """Lines of Markdown: pooled RMSE in mm by kind, with the ratio of `odeform` to the best rival."""
    lines = ["| data | " + " | ".join(MODELS) + " | of the best rival |", "|---" * (len(MODELS) + 2) + "|"]
    ratios = []
    for name, scores in found.items():
        errors = [scores[model]["rmse_pooled_mm"] for model in MODELS]
        ratios.append(errors[0] / min(errors[1:]))
        lines.append(f"| {name} | " + " | ".join(f"{error:.3g}" for error in errors) + f" | {ratios[-1]:.2f} |")
    mean = math.exp(sum(map(math.log, ratios)) / len(ratios))
    return [*lines, f"| geometric mean |{' |' * len(MODELS)} {mean:.2f} |"]


def main(argv: list[str] | None = None) -> None:
    """Make, import, train and score; finished trainings are not repeated."""
    parser = argparse.ArgumentParser("python -m odeform.tables.own_data", description=__doc__)
    parser.add_argument("--keep", type=Path, required=True, metavar="DIR", help="data, checkpoints and scores")
    parser.add_argument("--kinds", default=",".join(KINDS), metavar="NAME,...", help="default: all")
    parser.add_argument(
        "--data", type=Path, action="append", default=[], metavar="DIR", help="imported data set as well"
    )
    parser.add_argument("--minutes", type=float, default=30.0, metavar="M", help="of odeform train (default: 30)")
    args = parser.parse_args(argv)
    args.keep.mkdir(parents=True, exist_ok=True)
    found: dict[str, Scores] = {}
    for name in filter(None, args.kinds.split(",")):
        frames, dataset = args.keep / f"{name}-frames", args.keep / name
        if not (dataset / "dataset.json").exists():
            if not (frames / "parameters.csv").exists():
                write_folder(KINDS[name], frames, report=print_line)
            import_dataset(frames, dataset)
        found[name] = measure(dataset, args.keep, args.minutes)
    for dataset in args.data:
        found[dataset.name] = measure(dataset, args.keep, args.minutes)
    print("\n".join(summary(found)), file=sys.stdout)


if __name__ == "__main__":
    main()
