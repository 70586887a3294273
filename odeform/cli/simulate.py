"""`odeform simulate`."""

import argparse
import os
from typing import TYPE_CHECKING, Any

from odeform.cli.options import add_cluster, add_seed, parse_settings
from odeform.errors import FailedCheck, InputError, counted

if TYPE_CHECKING:
    from odeform.dataset.index import Dataset
    from odeform.simulation.objects.user_object import UserObject

__all__ = ["HELP", "add_options", "run"]

HELP = "Simulate a data set of a scene"


def add_options(parser: argparse.ArgumentParser) -> None:
    from odeform.simulation.scenes.registry import SCENES

    cores = os.cpu_count() or 1
    from odeform.simulation.objects.materials import CHOICE

    parser.add_argument("scene", metavar="SCENE", help=f"one of {', '.join(SCENES)}")
    parser.add_argument(
        "--geometry",
        metavar="FILE",
        help="simulate this mesh, points or splats as a soft body, in a scene of soft objects (default: 40 sequences)",
    )
    parser.add_argument(
        "--material",
        metavar="NAME",
        help=f"of --geometry: {', '.join(CHOICE)}, or KPA:DENSITY, as 60:120 (default: the softest of these under "
        "which it stands)",
    )
    parser.add_argument(
        "--out",
        required=True,
        metavar="DIR",
        help="folder to write to; an interrupted simulation is continued, a smaller data set extended",
    )
    parser.add_argument(
        "--count", type=int, metavar="N", help="number of sequences, of each object (default: the scene's)"
    )
    parser.add_argument(
        "--object", nargs="+", action="extend", default=[], metavar="NAME", help="objects to simulate (default: all)"
    )
    add_seed(parser, "parameters and splits")
    parser.add_argument(
        "--workers", type=int, default=cores, metavar="W", help=f"number of processes (default: {cores}, one per core)"
    )
    add_cluster(parser)
    parser.add_argument("--rate", type=float, metavar="HZ", help="frames per second (default: the scene's)")
    parser.add_argument(
        "--corners", action="store_true", help="also simulate the corners of the parameter box, for training"
    )
    parser.add_argument(
        "--range",
        nargs="+",
        action="extend",
        default=[],
        metavar="NAME=LOW:HIGH",
        help="ranges of parameters in place of the scene's, in kg, N m, N, rad; not for scenes with objects",
    )


def run(args: argparse.Namespace) -> None:
    from odeform.cluster import on_cluster
    from odeform.simulation.runner import UNEXPECTED

    ranges = {name: _range(name, text) for name, text in parse_settings(args.range, "--range").items()}
    asked = {name: getattr(args, name) for name in ("count", "seed", "workers", "rate", "corners")}
    with on_cluster(args.cluster):
        dataset = _simulated(args, asked, ranges)
    failed = [entry for entry in dataset.entries if entry.status != "ok"]
    print(f"{counted(len(dataset.entries) - len(failed), 'sequence')} in {args.out}; failed: {len(failed) or 'none'}")
    for entry in failed:
        print(f"{entry.name} failed: {entry.status}")
    if unexpected := sum(entry.status.startswith(UNEXPECTED) for entry in failed):
        ended = counted(unexpected, "sequence")
        raise FailedCheck(f"{ended} ended with an unexpected error; the same command tries them again")


def _simulated(args: argparse.Namespace, asked: dict[str, Any], ranges: dict[str, tuple[float, float]]) -> "Dataset":
    from odeform.simulation.runner import simulate
    from odeform.simulation.user_data import simulate_shape

    if args.geometry is None:
        if args.material is not None:
            raise InputError("--material: is that of a shape; expected it with --geometry")
        return simulate(args.scene, args.out, **asked, objects=args.object, ranges=ranges)
    for option, given in (("--object", args.object), ("--range", ranges), ("--corners", args.corners)):
        if given:
            raise InputError(f"{option}: not with --geometry, whose body is the only one")
    return simulate_shape(args.scene, args.geometry, args.out, args.material, made=_said, **asked)


def _said(body: "UserObject") -> None:
    """Say what was made of a shape, before it is simulated for minutes."""
    print(f"{body.item.name}: {1e3 * body.item.mass:,.0f} g {body.made}", flush=True)


def _range(name: str, text: str) -> tuple[float, float]:
    try:
        low, high = (float(end) for end in text.split(":"))
    except ValueError:
        raise InputError(f"--range {name}: expected two numbers LOW:HIGH, got {text!r}") from None
    return low, high
