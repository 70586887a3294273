"""`odeform evaluate`."""

import argparse
import sys
from typing import Any

from odeform.cli.options import (
    CHECKPOINT,
    add_data,
    add_json,
    add_quality,
    add_split,
    add_window,
    parse_window,
    write_json,
)

__all__ = ["HELP", "add_options", "run"]

HELP = "Score checkpoints on a data set"
COLUMNS = ("rmse_pooled_mm", "rmse_mm", "mae_mm", "relative", "deformation_relative", "off_grid_rmse_mm")


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("checkpoints", nargs="+", metavar="CKPT", help=CHECKPOINT)
    add_data(parser)
    add_split(parser)
    add_window(parser, "score")
    add_quality(parser)
    add_json(parser)


def run(args: argparse.Namespace) -> None:
    from odeform.dataset.store import open_dataset
    from odeform.evaluation.metrics import check_scene, evaluate
    from odeform.models.registry import load

    dataset, window = open_dataset(args.data), parse_window(args.window)
    models: dict[str, dict[str, Any]] = {}
    for name in args.checkpoints:
        predictor = load(name)
        check_scene(predictor, dataset)
        fixed = predictor.checkpoint.provenance.get("fixed")
        if fixed is not None and fixed != dataset.fixed:
            print(f"note: {name} was trained with {fixed}, the data set has {dataset.fixed}", file=sys.stderr)
        key = predictor.model if predictor.model not in models else name
        models[key] = evaluate(predictor, dataset, args.split, window, args.quality)
    write_json({"data": args.data, "split": args.split, "window": window, "models": models}, args.json)
    print(_table(models))


def _table(models: dict[str, dict[str, Any]]) -> str:
    rows = models | {f"{key} (impact)": scores["impact"] for key, scores in models.items() if "impact" in scores}
    lines = [f"{'model':<24}" + "".join(f"{column:>22}" for column in COLUMNS)]
    for key, scores in rows.items():
        cells = ("-" if scores[column] is None else f"{scores[column]:.4g}" for column in COLUMNS)
        lines.append(f"{key:<24}" + "".join(f"{cell:>22}" for cell in cells))
    if any(scores[column] is None for scores in rows.values() for column in COLUMNS):
        lines.append("-: not measured")
    return "\n".join(lines)
