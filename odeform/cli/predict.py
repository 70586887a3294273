"""`odeform predict`."""

import argparse
import sys

from odeform.cli.options import add_checkpoint, add_quality, parse_settings

__all__ = ["HELP", "add_options", "run"]

HELP = "Predict one motion and write it to a file"


def add_options(parser: argparse.ArgumentParser) -> None:
    from odeform.formats.registry import motion_endings

    add_checkpoint(parser)
    parser.add_argument("--out", required=True, metavar="FILE", help=f"file to write: {motion_endings()}")
    parser.add_argument(
        "--geometry",
        metavar="FILE",
        help="mesh, points or Gaussian splats to move, or volleyball (bundled); default: the trained body",
    )
    parser.add_argument(
        "--set",
        nargs="*",
        action="extend",
        default=[],
        metavar="NAME=VALUE",
        help="parameters in the units of `odeform info CKPT`; vectors as X,Y,Z; defaults for the others",
    )
    parser.add_argument(
        "--times", metavar="START:STOP:STEP", help="times in seconds, STOP excluded (default: the trained frames)"
    )
    add_quality(parser)


def run(args: argparse.Namespace) -> None:
    from odeform.formats.bundled import read_shape
    from odeform.formats.times import parse_times
    from odeform.formats.writing import write_motion
    from odeform.geometry.shape import fit_to
    from odeform.geometry.similarity import Similarity
    from odeform.models.registry import load
    from odeform.types import GaussianSplats

    predictor = load(args.checkpoint)
    times = predictor.schema.window.times if args.times is None else parse_times(args.times)
    fit = None
    if args.geometry is None and not predictor.rescales_input:
        _note(f"{args.checkpoint}: {predictor.schema.notes[-1]}")
    elif args.geometry is not None:
        shape, region = read_shape(args.geometry)
        fit = fit_to(shape, predictor.rest, region, transform=None if predictor.rescales_input else Similarity())
    geometry = fit.geometry if fit else None
    for note in geometry.notes if isinstance(geometry, GaussianSplats) else ():
        _note(f"{args.geometry}: {note}")
    motion = predictor.solve(geometry, parse_settings(args.set), args.quality, until=float(times[-1]))
    write_motion(motion, times, args.out, fit)
    for name in motion.outside:
        _note(f"{name} = {motion.parameters[name]:g} is outside the trained range")
    print(f"{len(times)} frames of {len(motion.geometry.points)} points to {args.out}; status {motion.stats.status}")


def _note(text: str) -> None:
    print(f"note: {text}", file=sys.stderr)
