"""The `odeform-viz` command."""

import argparse
import sys
import time
from collections.abc import Sequence

import odeform
from odeform.cli import run_guarded
from odeform.errors import InputError
from odeform.geometry.shape import FittedShape
from odeform.geometry.similarity import Similarity
from odeform.models.base import Predictor
from odeform_viz.columns import Column, truth_column
from odeform_viz.fitting import describe_fit, shape_from
from odeform_viz.recording.replay import TOLERANCE, replay

__all__ = ["main", "make_columns"]


def make_columns(checkpoint: str, compare: Sequence[str], geometry: str | None) -> list[Column]:
    """The columns that the command line asks for; a foreign shape is fitted to the first model's body."""
    models = {name: odeform.load(name) for name in dict.fromkeys((checkpoint, *compare))}
    body, fit = models[checkpoint].rest, None
    if geometry is not None:
        fit = shape_from(geometry, body, None if models[checkpoint].rescales_input else Similarity())
        print(describe_fit(fit, geometry, body))
    return [
        Column(_label(model, fit), model, fit.geometry if fit else model.rest, origin=name, fit=fit)
        for name, model in ((name, models[name]) for name in (checkpoint, *compare))
    ]


def _label(model: Predictor, fit: FittedShape | None) -> str:
    return model.model if fit or model.rescales_input else f"{model.model}, on a ball that stands in"


def _serve(args: argparse.Namespace) -> None:
    if args.device == "cuda":
        raise InputError("--device cuda: a motion is a state of 160 numbers, solved on the CPU; expected cpu")
    columns = make_columns(args.checkpoint, args.compare, args.geometry)
    if args.sequence:
        columns.append(truth_column(args.sequence))
    from odeform_viz.app import App

    app = App(columns, args.host, args.port, args.record)
    print(f"ODeform {columns[0].source.schema.scene}: open {app.url} (Ctrl-C ends)", flush=True)
    try:
        while True:
            time.sleep(3600.0)
    finally:
        app.close()


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="odeform-viz", description="See and question learned motion.")
    parser.add_argument("--checkpoint", default="kick", metavar="CKPT", help="path or bundled name (default: kick)")
    parser.add_argument("--compare", nargs="+", default=[], metavar="CKPT", help="further models, side by side")
    parser.add_argument(
        "--geometry", metavar="FILE", help="a mesh, points or Gaussian splats to move instead (bundled: volleyball)"
    )
    parser.add_argument("--sequence", metavar="PATH", help="show a sequence of a data set as truth: DATASET/NAME")
    parser.add_argument("--host", default="127.0.0.1", metavar="H")
    parser.add_argument("--port", type=int, default=8080, metavar="N")
    parser.add_argument("--record", metavar="FILE.rrd", help="log the session to a Rerun recording")
    parser.add_argument("--replay", metavar="FILE.rrd", help="compute a recording again, compare, and end")
    parser.add_argument(
        "--tolerance",
        type=float,
        default=TOLERANCE,
        metavar="M",
        help="metres that a replay may differ (default: 1e-5)",
    )
    parser.add_argument("--device", default="cpu", choices=("cpu", "cuda"))
    args = parser.parse_args(argv)

    agrees = True

    def work() -> None:
        nonlocal agrees
        if args.replay:
            agrees = replay(args.replay, args.tolerance)
            return
        try:
            _serve(args)
        except KeyboardInterrupt:
            print("closed")

    return run_guarded(work) or int(not agrees)


if __name__ == "__main__":
    sys.exit(main())
