"""`odeform identify`."""

import argparse

from odeform.cli.options import add_checkpoint, add_data, add_json, add_seed, add_split, positive, write_json

__all__ = ["HELP", "add_options", "run"]

HELP = "Estimate the parameters of observed motions, all together, with intervals"


def add_options(parser: argparse.ArgumentParser) -> None:
    add_checkpoint(parser)
    add_data(parser)
    add_split(parser)
    parser.add_argument("--limit", type=int, metavar="N", help="use the first N sequences (default: all)")
    parser.add_argument(
        "--points", type=int, metavar="N", help="observe N random points of the surface (default: the vertices)"
    )
    parser.add_argument("--frames", type=int, metavar="K", help="observe K random frames (default: all)")
    parser.add_argument(
        "--noise", type=float, default=0.0, metavar="MM", help="noise to add to each coordinate, in mm (default: 0)"
    )
    add_seed(parser, "points, frames and noise")
    add_json(parser)


def run(args: argparse.Namespace) -> None:
    from odeform.dataset.store import open_dataset
    from odeform.identification.observation import View
    from odeform.identification.table import identify_split, report
    from odeform.models.registry import load

    if args.limit is not None:
        positive("--limit", args.limit)
    view = View(args.points, args.frames, args.noise, args.seed)
    result = identify_split(load(args.checkpoint), open_dataset(args.data), args.split, args.limit, view)
    write_json(result, args.json)
    print(report(result))
