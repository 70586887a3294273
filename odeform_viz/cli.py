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
    """A column for each checkpoint. A shape from a file is fitted to the body of the first model, and printed how.

    `InputError` for checkpoints and shapes that cannot be read.
    """
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
    """The authors' files contain no body, so a ball is shown unless the user gives one."""
    return model.model if fit or model.rescales_input else f"{model.model} (shown on a ball)"


def _serve(args: argparse.Namespace) -> None:
    if args.device == "cuda":
        raise InputError("--device: expected cpu, got cuda: motions are so small that the CPU computes them faster")
    columns = make_columns(args.checkpoint, args.compare, args.geometry)
    if args.sequence:
        columns.append(truth_column(args.sequence))
    from odeform_viz.app import App

    app = App(columns, args.host, args.port, args.record)
    try:
        print(f"ODeform {columns[0].source.schema.scene}: open {app.url} (Ctrl-C to stop)", flush=True)
        while True:
            time.sleep(3600.0)
    finally:
        app.close()


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="odeform-viz",
        description="Serve a web page that shows learned motions of soft bodies and computes them as you change "
        "parameters. CKPT is a path or the name of a bundled checkpoint, SCENE or SCENE/MODEL.",
        epilog="Exit codes: 0 success; 1 internal error, or a replay that differs; 2 invalid input.",
    )
    parser.add_argument("--version", action="version", version=f"odeform-viz {odeform.__version__}")
    show = parser.add_argument_group("what to show")
    show.add_argument("--checkpoint", default="kick", metavar="CKPT", help="the model (default: kick)")
    show.add_argument("--compare", nargs="+", default=[], metavar="CKPT", help="more models of the scene, side by side")
    show.add_argument(
        "--geometry",
        metavar="FILE",
        help="move this shape instead of the trained body: a mesh, points or Gaussian splats (bundled: volleyball)",
    )
    show.add_argument(
        "--sequence", metavar="PATH", help="show a sequence of a data set, DATASET/NAME, as the truth beside the models"
    )
    page = parser.add_argument_group("where to serve")
    page.add_argument("--host", default="127.0.0.1", metavar="H", help="address to listen on (default: 127.0.0.1)")
    page.add_argument(
        "--port", type=int, default=8080, metavar="N", help="port to listen on; 0 takes a free one (default: 8080)"
    )
    page.add_argument("--device", default="cpu", choices=("cpu", "cuda"), help="where to compute: only on the cpu")
    record = parser.add_argument_group("recordings")
    record.add_argument("--record", metavar="FILE.rrd", help="record everything that is shown, for Rerun and --replay")
    record.add_argument(
        "--replay",
        metavar="FILE.rrd",
        help="compute every frame of a recording again, print the differences, and exit; serves no page",
    )
    record.add_argument(
        "--tolerance",
        type=float,
        default=TOLERANCE,
        metavar="M",
        help="largest difference, in metres, that --replay accepts (default: 1e-5)",
    )
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    args = _parser().parse_args(argv)
    agrees = True

    def work() -> None:
        nonlocal agrees
        if args.replay:
            agrees = replay(args.replay, args.tolerance)
            return
        try:
            _serve(args)
        except KeyboardInterrupt:
            print("stopped")

    return run_guarded(work) or int(not agrees)


if __name__ == "__main__":
    sys.exit(main())
