"""`odeform predict`."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from odeform.cli.options import add_checkpoint, add_quality, parse_settings
from odeform.errors import InputError, counted
from odeform.io import require_writable

if TYPE_CHECKING:
    from odeform.geometry.shape import FittedShape
    from odeform.models.base import Predictor
    from odeform.motion.recorded import RecordedMotion

__all__ = ["HELP", "add_options", "run"]

HELP = "Predict one motion and write it to a file"


def add_options(parser: argparse.ArgumentParser) -> None:
    from odeform.formats.registry import motion_endings
    from odeform.simulation.objects.materials import CHOICE

    add_checkpoint(parser)
    parser.add_argument("--out", required=True, metavar="FILE", help=f"file to write: {motion_endings()}")
    parser.add_argument(
        "--geometry",
        metavar="FILE",
        help="mesh, points or Gaussian splats to move, or volleyball (bundled); default: the trained body",
    )
    parser.add_argument(
        "--material",
        metavar="NAME",
        help=f"of a shape that becomes a body: {', '.join(CHOICE)}, or KPA:DENSITY, as 60:120 (default: the softest of "
        "these under which it stands)",
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
        "--truth",
        metavar="DATASET/NAME",
        help="stored or simulated sequence: predict its motion, with errors against it (.csv, or a figure)",
    )
    parser.add_argument(
        "--sweep",
        nargs="*",
        action="extend",
        default=[],
        metavar="NAME=LOW:HIGH",
        help="one to three parameters: write a figure (.html) with a slider for each, and for the time",
    )
    parser.add_argument(
        "--times", metavar="START:STOP:STEP", help="times in seconds, STOP excluded (default: the trained frames)"
    )
    parser.add_argument("--force", action="store_true", help="overwrite files that exist")
    add_quality(parser)


def run(args: argparse.Namespace) -> None:
    from odeform.cli.predict_figure import write_figure
    from odeform.formats.times import parse_times
    from odeform.formats.writing import motion_files, write_motion
    from odeform.models.registry import load, observations
    from odeform.motion.caveats import caveats

    predictor = load(args.checkpoint)
    times = predictor.schema.window.times if args.times is None else parse_times(args.times)
    _require_new(motion_files(args.out, len(times), bool(args.truth and not args.sweep)), args.force)
    settings = parse_settings(args.set)
    if args.sweep:
        write_figure(args, predictor, settings, times, _shape)
        return
    truth, settings = _read_truth(args, predictor, settings) if args.truth else (None, settings)
    predictor, fit, settings = _shape(args, predictor, settings)
    geometry = fit.geometry if fit else truth and predictor.to_body_frame(truth.geometry, settings)
    observed = truth and observations(predictor.schema, truth.sequence)
    motion = predictor.solve(geometry, settings, args.quality, until=float(times[-1]), observed=observed)
    write_motion(motion, times, args.out, fit, truth)
    for caveat in caveats(motion, times):
        _note(caveat)
    stop = motion.first_stop(float(times.max()))
    status = motion.stats.status if stop is None else str(stop)
    written = f"{counted(len(times), 'frame')} of {counted(len(motion.geometry.points), 'point')}"
    print(f"{written} to {args.out}; status {status}")


def _shape(
    args: argparse.Namespace, predictor: "Predictor", settings: dict[str, Any]
) -> "tuple[Predictor, FittedShape | None, dict[str, Any]]":
    """The shape of `--geometry` as `predictor` moves it, with the predictor and the settings for it; None without."""
    from odeform.formats.bundled import moving_part, read_shape
    from odeform.geometry.shape import fit_to
    from odeform.geometry.similarity import UPRIGHT, Similarity
    from odeform.models.modal.user_body import UserBodyPredictor, takes_user_bodies, user_body
    from odeform.simulation.objects.materials import material_of

    fit = None
    if args.geometry is None and not predictor.rescales_input:
        for note in predictor.schema.notes[-1:]:
            _note(f"{args.checkpoint}: {note}")
    elif args.geometry is not None and takes_user_bodies(predictor):
        material = None if args.material is None else material_of(args.material)
        own = user_body(moving_part(*read_shape(args.geometry)), Path(args.geometry).name, material=material)
        predictor = UserBodyPredictor(predictor, own)
        fit, settings = predictor.user_body.fit, {**predictor.parameters_like(), **settings}
        _note(f"{args.geometry}: {predictor.user_body.made}")
    elif args.geometry is not None:
        shape, region = read_shape(args.geometry)
        as_it_is = None if predictor.rescales_input else Similarity(rotation=UPRIGHT[shape.up or "+z"])
        fit = fit_to(shape, predictor.rest, region, transform=as_it_is)
        if fit.upright:
            _note(f"{args.geometry}: {fit.upright.replace('*', '')}")
    for note in fit.source.notes if fit else ():
        _note(f"{args.geometry}: {note}")
    return predictor, fit, settings


def _read_truth(
    args: argparse.Namespace, predictor: "Predictor", settings: dict[str, Any]
) -> "tuple[RecordedMotion, dict[str, Any]]":
    """The sequence of `--truth`, and its parameters with those of `--set`."""
    from odeform.simulation.recorded import read_truth

    if args.geometry is not None:
        raise InputError("--truth compares the truth's own body: leave out --geometry")
    truth, schema = read_truth(args.truth), predictor.schema
    if truth.schema.scene != schema.scene:
        raise InputError(f"--truth {args.truth}: expected a sequence of {schema.scene}, got {truth.schema.scene}")
    settings = schema.complete({**schema.known(truth.setting), **schema.expanded(settings)})
    if not truth.of(settings):
        raise InputError(f"--truth {args.truth}: --set gives other parameters than the sequence has")
    return truth, settings


def _require_new(files: Sequence[Path], force: bool) -> None:
    """`InputError` where a file cannot be written, or exists and is not to be overwritten."""
    folder = files[0].parent
    if not folder.is_dir():
        raise InputError(f"--out {files[0]}: expected a folder that exists, got {folder}")
    require_writable(files[0])
    existing = [] if force else [file for file in files if file.exists()]
    if existing:
        more = f" and {len(existing) - 1} more" if len(existing) > 1 else ""
        raise InputError(f"--out: {existing[0]}{more} would be overwritten; add --force if that is meant")


def _note(text: str) -> None:
    print(f"note: {text}", file=sys.stderr)
