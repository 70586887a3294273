"""`odeform evaluate`."""

import argparse
import sys
from typing import Any

from odeform.cli.options import (
    CHECKPOINT,
    add_data,
    add_json,
    add_part,
    add_quality,
    add_split,
    add_window,
    parse_part,
    parse_window,
    write_json,
)
from odeform.errors import InputError

__all__ = ["HELP", "add_options", "run"]

HELP = "Score checkpoints on a data set"
COLUMNS = (
    "rmse_pooled_mm",
    "rmse_pooled_95",
    "median_mm",
    "rmse_mm",
    "mae_mm",
    "relative",
    "deformation_relative",
    "off_grid_rmse_mm",
)


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("checkpoints", nargs="+", metavar="CKPT", help=CHECKPOINT)
    add_data(parser)
    add_split(parser)
    add_part(parser)
    add_window(parser, "score")
    add_quality(parser)
    parser.add_argument(
        "--attach",
        metavar="FILE",
        help="write the one checkpoint with scores of these motions, which nothing may have been fitted to: its error "
        "band then holds for whole motions",
    )
    add_json(parser)


def run(args: argparse.Namespace) -> None:
    from odeform.dataset.store import open_dataset
    from odeform.evaluation.calibration import attach
    from odeform.evaluation.metrics import check_scene, evaluate
    from odeform.models.registry import load

    if args.attach is not None and len(args.checkpoints) > 1:
        raise InputError("--attach: expected one checkpoint")
    dataset, window = open_dataset(args.data).part(*parse_part(args.part)), parse_window(args.window)
    models: dict[str, dict[str, Any]] = {}
    for name in args.checkpoints:
        predictor = load(name)
        check_scene(predictor, dataset)
        fixed = predictor.checkpoint.provenance.get("fixed")
        if fixed is not None and fixed != dataset.fixed:
            print(f"note: {name} was trained with {fixed}, the data set has {dataset.fixed}", file=sys.stderr)
        key = predictor.model if predictor.model not in models else name
        models[key] = evaluate(predictor, dataset, args.split, window, args.quality)
    if args.attach is not None:
        source = f"{args.data}, split {args.split}, part {args.part or '1/1'}"
        attach(load(args.checkpoints[0]), dataset, args.split, args.attach, source)
    write_json(
        {"data": args.data, "split": args.split, "part": args.part, "window": window, "models": models}, args.json
    )
    print(_table(models))
    for key, scores in models.items():
        if (inside := scores["motions_covered_90"]) is not None:
            print(f"{key}: {inside:.1%} of {scores['sequences']} motions stay within the error band throughout")


def _rows(key: str, scores: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    """The rows of one model: all sequences, the impact, and each object below."""
    rows = [(key, scores)]
    rows += [(f"{key} (impact)", scores["impact"])] if "impact" in scores else []
    objects = scores["per_object"]
    rows += [(f"  {name}", one) for name, one in objects.items()]
    return rows + ([(f"  mean of {len(objects)} objects", scores["mean_of_objects"])] if objects else [])


def _cell(value: float | tuple[float, float] | None) -> str:
    if value is None:
        return "-"
    return " to ".join(f"{x:.3g}" for x in value) if isinstance(value, tuple) else f"{value:.4g}"


def _table(models: dict[str, dict[str, Any]]) -> str:
    rows = [row for key, scores in models.items() for row in _rows(key, scores)]
    lines = [f"{'model':<24}" + "".join(f"{column:>22}" for column in COLUMNS)]
    for label, scores in rows:
        cells = (_cell(scores.get(column)) for column in COLUMNS)
        lines.append(f"{label:<24}" + "".join(f"{cell:>22}" for cell in cells))
    if any(scores.get(column) is None for _, scores in rows for column in COLUMNS):
        lines.append("-: not measured")
    return "\n".join(lines)
