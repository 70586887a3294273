"""`odeform import`."""

import argparse
import sys

from odeform.cli.options import add_seed
from odeform.errors import one_line

__all__ = ["HELP", "add_options", "run"]

HELP = "Import the paper authors' data, or motions as mesh frames, arrays or motion capture"


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "source", metavar="SRC", help="the authors' folder, or a folder (or .zip) of sequences with parameters.csv"
    )
    parser.add_argument("--out", required=True, metavar="DIR", help="folder to write the data set to")
    parser.add_argument(
        "--rate", type=float, metavar="HZ", help="frames per second, for frames whose table has no rate"
    )
    parser.add_argument(
        "--unit", default="m", help="of lengths in files that do not say theirs, such as mm or in (default: m)"
    )
    add_seed(parser, "the splits of a source that has none")


def run(args: argparse.Namespace) -> None:
    from odeform.dataset.importers.registry import import_dataset

    dataset = import_dataset(args.source, args.out, args.rate, args.seed, args.unit)
    for note in dataset.provenance.get("notes", ()):
        print(f"note: {one_line(note)}", file=sys.stderr)
    failed = [entry.name for entry in dataset.entries if entry.status != "ok"]
    counts = ", ".join(f"{len(dataset.select(split))} {split}" for split in ("train", "val", "test"))
    varied = ", ".join(p.name for p in dataset.schema.parameters)
    window, size = dataset.schema.window, dataset.provenance["size_m"]
    print(
        f"{dataset.schema.scene} in {args.out}: {counts}; parameters: {varied}; failed: {', '.join(failed) or 'none'}; "
        f"a body of {size:g} m, {window.rate:g} frames per second for {window.stop:.4g} s"
    )
