"""`odeform simulate`."""

import argparse
import os

from odeform.cli.options import add_seed

__all__ = ["HELP", "add_options", "run"]

HELP = "Simulate a data set of a scene"


def add_options(parser: argparse.ArgumentParser) -> None:
    from odeform.simulation.scenes.registry import SCENES

    cores = os.cpu_count() or 1
    parser.add_argument("scene", metavar="SCENE", help=f"one of {', '.join(SCENES)}")
    parser.add_argument(
        "--out", required=True, metavar="DIR", help="folder to write to; an interrupted simulation is continued"
    )
    parser.add_argument("--count", type=int, metavar="N", help="number of sequences (default: the scene's)")
    add_seed(parser, "parameters and splits")
    parser.add_argument(
        "--workers", type=int, default=cores, metavar="W", help=f"number of processes (default: {cores}, one per core)"
    )
    parser.add_argument("--rate", type=float, metavar="HZ", help="frames per second (default: the scene's)")
    parser.add_argument(
        "--corners", action="store_true", help="also simulate the corners of the parameter box, for training"
    )


def run(args: argparse.Namespace) -> None:
    from odeform.simulation.runner import simulate

    dataset = simulate(args.scene, args.out, args.count, args.seed, args.workers, args.rate, corners=args.corners)
    failed = [entry for entry in dataset.entries if entry.status != "ok"]
    print(f"{len(dataset.entries) - len(failed)} sequences in {args.out}; failed: {len(failed) or 'none'}")
    for entry in failed:
        print(f"{entry.name} failed: {entry.status}")
