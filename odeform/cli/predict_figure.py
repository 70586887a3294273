"""`odeform predict --sweep`."""

import argparse
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from odeform.cli.options import parse_settings
from odeform.errors import InputError, counted
from odeform.figure import Source, column_bytes, figure_page, interpolated, parse_sweeps, truth_error
from odeform.geometry.shape import FittedShape
from odeform.io import atomic_write
from odeform.models.base import Predictor
from odeform.models.titles import family_title
from odeform.motion.caveats import caveats
from odeform.types import Times

__all__ = ["write_figure"]

Shape = Callable[[argparse.Namespace, Predictor, dict[str, Any]], tuple[Predictor, FittedShape | None, dict[str, Any]]]


def write_figure(
    args: argparse.Namespace, predictor: Predictor, settings: dict[str, Any], times: Times, shape_of: Shape
) -> None:
    """Writes the figure of `args`, whose shape `shape_of` reads, and says how far it is from the model.

    With `--truth`, other parameters are those of the sequence. Raises `InputError` for a name that does not end in
    .html, a truth that is not under the sliders, and what a figure does not take.
    """
    if Path(args.out).suffix.lower() != ".html":
        raise InputError(f"--sweep: expected --out FILE.html, got {args.out}")
    from odeform.simulation.recorded import read_truth  # slow to import

    ranges: Mapping[str, str] = parse_settings(args.sweep, "--sweep")
    truth, fixed = read_truth(args.truth) if args.truth else None, predictor.schema.expanded(settings)
    if truth is not None:
        fixed = {**{k: v for k, v in predictor.schema.known(truth.setting).items() if k not in ranges}, **fixed}
    sweeps = parse_sweeps(predictor.schema, ranges, tuple(fixed))
    predictor, fit, fixed = shape_of(args, predictor, fixed)
    fixed = {name: value for name, value in fixed.items() if name not in ranges}
    source = Source(predictor, sweeps, fixed, fit and fit.geometry, args.quality, fit and fit.static)
    column = interpolated(family_title(predictor.model), source, times, column_bytes(1), _report)
    if truth is not None and truth_error(column, truth) is None:
        raise InputError(f"--truth {args.truth}: expected a sequence of this scene with parameters under the sliders")
    page = figure_page([column], truth)
    atomic_write(Path(args.out), page)
    error = column.error
    print(
        f"{counted(len(column.table.weights), 'motion')} in {len(page) / 1e6:.2f} MB to {args.out}; from the model: "
        f"{error.rms:.2g} mm RMS distance, half within {error.half:.2g}, 90 % within {error.most:.2g} mm"
    )
    for caveat in caveats(source.middle, times):
        print(f"note: {caveat}", file=sys.stderr)
    if not column.fine:
        half, most = column.tolerance_mm
        print(f"note: expected at most {half:.2g} and {most:.2g} mm", file=sys.stderr)


def _report(motions: int, most: int, error: float) -> None:
    print(f"{counted(motions, 'motion')} of at most {most}: {error:.3g} mm RMS distance", file=sys.stderr, flush=True)
