"""Small data sets of several kinds, trained with default settings.

Run `python -m odeform_figures.tables.user_data --keep DIR`.
"""

import argparse
import json
import math
import statistics
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from odeform.dataset.importers.registry import import_dataset
from odeform.dataset.store import open_dataset
from odeform.io import atomic_write
from odeform.training.train import print_line, train
from odeform_figures.motions.folder import write_folder
from odeform_figures.motions.registry import KINDS

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
            weights = {"correction": checkpoint.config.get("correction")}
            atomic_write(out, json.dumps({**scores, **taken, **weights}, indent=1).encode())
        found[model] = json.loads(out.read_text())
    return found


def summary(found: Mapping[str, Sequence[Scores]]) -> list[str]:
    """Lines of Markdown: pooled RMSE in mm by kind, its mean and standard deviation over data sets of that kind.

    Ends with the ratio of `odeform` to the best rival, the one with the least mean.
    """
    lines = ["| data | " + " | ".join(MODELS) + " | of the best rival |", "|---" * (len(MODELS) + 2) + "|"]
    ratios = []
    for name, sets in found.items():
        errors = [[scores[model]["rmse_pooled_mm"] for scores in sets] for model in MODELS]
        means = [statistics.mean(each) for each in errors]
        ratios.append(means[0] / min(means[1:]))
        lines.append(f"| {name} | {' | '.join(map(_mean, errors))} | {ratios[-1]:.2f} |")
    mean = math.exp(statistics.mean(map(math.log, ratios)))
    return [*lines, f"| geometric mean |{' |' * len(MODELS)} {mean:.2f} |"]


def _mean(errors: Sequence[float]) -> str:
    spread = f" ± {statistics.stdev(errors):.2g}" if len(errors) > 1 else ""
    return f"{statistics.mean(errors):.3g}{spread}"


def _made(name: str, seed: int, keep: Path) -> Path:
    """The data set of a kind, whose parameters are drawn anew for each seed."""
    dataset = keep / (f"{name}-{seed}" if seed else name)
    frames = dataset.with_name(f"{dataset.name}-frames")
    if not (dataset / "dataset.json").exists():
        if not (frames / "parameters.csv").exists():
            write_folder(KINDS[name], frames, seed, report=print_line)
        import_dataset(frames, dataset)
    return dataset


def main(argv: list[str] | None = None) -> None:
    """Make, import, train and score; finished trainings are not repeated."""
    parser = argparse.ArgumentParser("python -m odeform_figures.tables.user_data", description=__doc__)
    parser.add_argument("--keep", type=Path, required=True, metavar="DIR", help="data, checkpoints and scores")
    parser.add_argument("--kinds", default=",".join(KINDS), metavar="NAME,...", help="default: all")
    parser.add_argument(
        "--data", type=Path, action="append", default=[], metavar="DIR", help="imported data set as well"
    )
    parser.add_argument("--minutes", type=float, default=30.0, metavar="M", help="of odeform train (default: 30)")
    parser.add_argument("--seeds", type=int, default=1, metavar="N", help="data sets of each kind (default: 1)")
    args = parser.parse_args(argv)
    args.keep.mkdir(parents=True, exist_ok=True)
    names = filter(None, args.kinds.split(","))
    sets = {name: [_made(name, seed, args.keep) for seed in range(args.seeds)] for name in names}
    sets |= {dataset.name: [dataset] for dataset in args.data}
    found = {name: [measure(each, args.keep, args.minutes) for each in made] for name, made in sets.items()}
    print("\n".join(summary(found)), file=sys.stdout)


if __name__ == "__main__":
    main()
