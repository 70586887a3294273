"""`odeform tables`."""

import argparse
import os
from pathlib import Path

from odeform.cli.options import add_cluster, positive

__all__ = ["HELP", "add_options", "run"]

HELP = "Train every model of the paper's tables and write the tables as Markdown"


def add_options(parser: argparse.ArgumentParser) -> None:
    cores = os.cpu_count() or 1
    parser.add_argument(
        "--keep", required=True, metavar="DIR", help="folder of checkpoints and scores; what it holds is not redone"
    )
    parser.add_argument("--out", required=True, metavar="FILE.md", help="Markdown file to write")
    parser.add_argument(
        "--fraction",
        type=float,
        default=1.0,
        metavar="X",
        help="fraction of the planned training steps (default: 1)",
    )
    parser.add_argument(
        "--jobs", type=int, default=cores, metavar="N", help=f"trainings at a time (default: {cores}, one per core)"
    )
    add_cluster(parser, "; they must see the folder of --keep")
    parser.add_argument(
        "--kept-only", action="store_true", help="train nothing; entries that are not in DIR stay empty"
    )


def run(args: argparse.Namespace) -> None:
    from odeform.cluster import on_cluster
    from odeform_figures.tables.tables import tables

    positive("--fraction", args.fraction)
    positive("--jobs", args.jobs)
    keep = Path(args.keep).resolve()  # workers have other current folders
    keep.mkdir(parents=True, exist_ok=True)
    with on_cluster(args.cluster, shared=keep):
        tables(keep, Path(args.out), args.fraction, args.jobs, args.kept_only)
