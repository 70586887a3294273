"""`odeform import`."""

import argparse

from odeform.cli.options import add_seed

__all__ = ["HELP", "add_options", "run"]

HELP = "Import the paper authors' data, or folders of mesh frames"


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "source", metavar="SRC", help="the authors' folder, or a folder of sequence folders with parameters.csv"
    )
    parser.add_argument("--out", required=True, metavar="DIR", help="folder to write the data set to")
    parser.add_argument(
        "--rate", type=float, metavar="HZ", help="frames per second, for mesh frames whose table has no rate"
    )
    add_seed(parser, "the splits of a source that has none")


def run(args: argparse.Namespace) -> None:
    from odeform.dataset.importers.registry import import_dataset

    dataset = import_dataset(args.source, args.out, args.rate, args.seed)
    failed = [entry.name for entry in dataset.entries if entry.status != "ok"]
    counts = ", ".join(f"{len(dataset.select(split))} {split}" for split in ("train", "val", "test"))
    varied = ", ".join(p.name for p in dataset.schema.parameters)
    print(
        f"{dataset.schema.scene} in {args.out}: {counts}; parameters: {varied}; failed: {', '.join(failed) or 'none'}"
    )
