"""The `odeform-viz` command."""

import argparse
import signal
import sys
import time
from collections.abc import Sequence

import odeform
from odeform.cli import run_guarded
from odeform.cli.options import Parser, add_plugin, load_plugins
from odeform.errors import InputError
from odeform.geometry.shape import FittedShape
from odeform.geometry.similarity import Similarity
from odeform.models.base import Predictor
from odeform_viz.columns import Column, truth_column
from odeform_viz.fitting import describe_fit, shape_from
from odeform_viz.recording.replay import TOLERANCE, replay
from odeform_viz.runtime.access import is_loopback
from odeform_viz.user_bodies import describe_user_body, read_user_body, takes_user_bodies, with_user_body
from odeform_viz.words import model_title

__all__ = ["main", "make_columns"]


WAKING = 0.5  # s; a Ctrl-C that the system gives to another thread does not end a sleep, and is noticed after it


def make_columns(
    checkpoint: str, compare: Sequence[str], geometry: str | None, material: str | None = None
) -> list[Column]:
    """A column for each checkpoint. A shape from a file is fitted to the body of the first model, and printed how.

    `InputError` for checkpoints and shapes that cannot be read.
    """
    models = {name: odeform.load(name) for name in dict.fromkeys((checkpoint, *compare))}
    if geometry is not None and takes_user_bodies(models[checkpoint]):
        print(f"{geometry}: making a soft body of it...", flush=True)
        body = read_user_body(geometry, material)
        print(describe_user_body(body))
        columns = [Column(_label(m, None), m, m.rest, origin=name) for name, m in models.items()]
        return with_user_body(columns, body)
    body, fit = models[checkpoint].rest, None
    if geometry is not None:
        fit = shape_from(geometry, body, None if models[checkpoint].rescales_input else Similarity())
        print(describe_fit(fit, geometry, models[checkpoint].validity.similarity(fit.geometry)))
    return [
        Column(_label(model, fit), model, fit.geometry if fit else model.rest, origin=name, fit=fit)
        for name, model in ((name, models[name]) for name in (checkpoint, *compare))
    ]


def _label(model: Predictor, fit: FittedShape | None) -> str:
    """The authors' files contain no body, so a ball is shown unless the user gives one."""
    name = model_title(model)
    return name if fit or model.bodies else f"{name} (shown on a ball)"


def _serve(args: argparse.Namespace) -> None:
    if args.device == "cuda":
        raise InputError("--device: expected cpu, got cuda: motions are so small that the CPU computes them faster")
    if not is_loopback(args.host) and not args.expose:
        raise InputError(
            f"--host {args.host}: whoever reaches this address can drive the viewer and write recordings; add --expose "
            "if that is meant"
        )
    columns = make_columns(args.checkpoint, args.compare, args.geometry, args.material)
    if args.sequence:
        columns.append(truth_column(args.sequence))
    from odeform_viz.app import App

    app = App(columns, args.host, args.port, args.record, origins=args.allow_origin, workspace=args.workspace)
    try:
        if not is_loopback(args.host):
            print(f"warning: any machine that reaches {app.url} can drive this viewer", file=sys.stderr, flush=True)
        print(f"ODeform {columns[0].source.schema.scene}: open {app.url} (Ctrl-C to stop)", flush=True)
        _wait_for_interrupt()
    finally:
        app.close()


def _wait_for_interrupt() -> None:
    """Return never, but by `KeyboardInterrupt` within `WAKING` seconds of a Ctrl-C.

    It is noted, not raised where it comes: a finalizer or a callback of a library may run then, which would swallow it.
    """
    asked: list[int] = []
    before = signal.getsignal(signal.SIGINT)
    if before is not signal.SIG_IGN:  # as in the background of a script
        signal.signal(signal.SIGINT, lambda number, _: asked.append(number))
    try:
        while not asked:
            time.sleep(WAKING)
    finally:
        signal.signal(signal.SIGINT, before)
    raise KeyboardInterrupt


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
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
        "--material",
        metavar="NAME",
        help="of a shape that becomes a soft body: a name, or KPA:DENSITY (see `odeform predict --help`)",
    )
    show.add_argument(
        "--sequence", metavar="PATH", help="show a sequence of a data set, DATASET/NAME, as the truth beside the models"
    )
    add_plugin(show)
    _add_page(parser.add_argument_group("where to serve"))
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


def _add_page(page: argparse._ActionsContainer) -> None:
    page.add_argument("--host", default="127.0.0.1", metavar="H", help="address to listen on (default: 127.0.0.1)")
    page.add_argument(
        "--port", type=int, default=8080, metavar="N", help="port to listen on; 0 takes a free one (default: 8080)"
    )
    page.add_argument(
        "--expose",
        action="store_true",
        help="allow a --host that other machines reach: they can drive the viewer, there is no password",
    )
    page.add_argument(
        "--allow-origin",
        action="append",
        default=[],
        metavar="ORIGIN",
        help="also answer at this address, of a reverse proxy for instance: https://lab.example (may be repeated)",
    )
    page.add_argument(
        "--workspace",
        default=".",
        metavar="DIR",
        help="folder of the files that the page names: recordings, and what a restored state opens (default: the "
        "current one)",
    )
    page.add_argument("--device", default="cpu", choices=("cpu", "cuda"), help="where to compute: only on the cpu")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    args = _parser().parse_args(argv)
    agrees = True

    def work() -> None:
        nonlocal agrees
        load_plugins(args.plugin)
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
