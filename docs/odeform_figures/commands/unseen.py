"""`odeform unseen`."""

import argparse
import os
from pathlib import Path
from typing import Any

from odeform.cli.options import add_checkpoint, add_json, add_seed, positive, write_json

__all__ = ["HELP", "add_options", "run"]

HELP = "Measure a model of pushed bodies on shapes that it was not trained on"
COLUMNS = ("distance", "moved_mm", "model_mm", "rigid_mm", "nearest_mm", "seen_mm", "ratio", "relative_ratio")


def add_options(parser: argparse.ArgumentParser) -> None:
    cores = os.cpu_count() or 1
    add_checkpoint(parser)
    parser.add_argument(
        "--keep", required=True, metavar="DIR", help="folder of simulated motions; what it holds is not simulated again"
    )
    parser.add_argument(
        "--shape", nargs="+", action="extend", default=[], metavar="MESH", help="scanned solids to measure as well"
    )
    parser.add_argument(
        "--simulated",
        nargs="+",
        action="extend",
        default=[],
        metavar="DIR",
        help="folders of `odeform simulate contact-force --geometry FILE` to measure as well",
    )
    parser.add_argument(
        "--data",
        metavar="DATASET",
        help="training data: each class is also predicted as a shape that is like another class",
    )
    parser.add_argument(
        "--object", nargs="+", action="extend", default=[], metavar="NAME", help="classes of instances (default: all)"
    )
    parser.add_argument("--no-instances", action="store_true", help="leave out other instances of the classes")
    parser.add_argument("--code", action="store_true", help="measure shapes that are made by code as well")
    parser.add_argument("--pushes", type=int, default=10, metavar="N", help="simulated for each shape (default: 10)")
    add_seed(parser, "contacts and forces")
    parser.add_argument(
        "--workers", type=int, default=cores, metavar="W", help=f"number of processes (default: {cores}, one per core)"
    )
    parser.add_argument(
        "--kept-only", action="store_true", help="make nothing; shapes that are not in DIR are left out"
    )
    parser.add_argument("--attach", action="store_true", help="store the error band in the checkpoint")
    add_json(parser)


def run(args: argparse.Namespace) -> None:
    from odeform_figures.unseen.unseen import Plan, attach_band, unseen

    positive("--pushes", args.pushes)
    positive("--workers", args.workers)
    scans, objects = tuple(Path(path) for path in args.shape), tuple(args.object)
    plan = Plan(
        Path(args.keep),
        args.pushes,
        args.seed,
        objects,
        not args.no_instances,
        args.code,
        scans,
        tuple(Path(folder) for folder in args.simulated),
        args.data,
        args.workers,
        args.kept_only,
    )
    result = unseen(args.checkpoint, plan)
    write_json(result, args.json)
    print(_report(result))
    if args.attach:
        attach_band(args.checkpoint, result)
        print(f"error band stored in {args.checkpoint}")


def _report(result: dict[str, Any]) -> str:
    lines = []
    for kind, mean in result["kinds"].items():
        rows = {name: row for name, row in result["shapes"].items() if row["kind"] == kind}
        if not rows:
            continue
        columns = (*COLUMNS, "in_known_band") if any(row["within_known_band"] for row in rows.values()) else COLUMNS
        lines.append(f"{kind:<44} {'like':<10}" + "".join(f"{column:>15}" for column in columns))
        for name, row in rows.items():
            cells = "".join(f"{row[column]:>15.3g}" for column in COLUMNS)
            if row["within_known_band"] is not None:
                cells += f"{row['within_known_band']:>15.0%}"
            failed = f"  failed: {len(row['failed'])}" if row["failed"] else ""
            lines.append(f"  {name:<42} {row['like']:<10}{cells}{failed}")
        lines.append(
            f"  ratio {mean['mean_ratio']:.2f} on average, {mean['largest_ratio']:.2f} at most (bar: {mean['bar']:g}); "
            f"better than the nearest object on {mean['better_than_nearest']}, than rigid motion on "
            f"{mean['better_than_rigid']} of {mean['shapes']}"
        )
    for name, reasons in result["not_simulated"].items():
        lines.append(f"{name}: no motion to compare with, {reasons[0]}")
    if result["coverage_90"] is not None:
        found = list(result["coverage_90"].values())
        least = min(result["coverage_90"], key=result["coverage_90"].__getitem__)
        lines.append(
            f"90 % error band, calibrated by all other shapes: covers {100.0 * sum(found) / len(found):.0f} % of the "
            f"frames of {len(found)} shapes, which count alike; least {100.0 * min(found):.0f} % ({least})"
        )
    return "\n".join(lines)
