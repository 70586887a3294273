"""`odeform bench`."""

import argparse

from odeform.cli.options import add_checkpoint, add_data, add_json, write_json

__all__ = ["HELP", "add_options", "run"]

HELP = "Measure speed against accuracy on this machine, compared with other models and solvers"


def add_options(parser: argparse.ArgumentParser) -> None:
    add_checkpoint(parser, default="kick")
    add_data(parser, required=False, text="data set to measure errors on (default: the bundled one of the scene)")
    add_json(parser)


def run(args: argparse.Namespace) -> None:
    from odeform.benchmark.bench import bench
    from odeform.benchmark.report import report

    result = bench(args.checkpoint, args.data)
    write_json(result, args.json)
    print(report(result))
