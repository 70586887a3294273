"""The `odeform-viz` command."""

import argparse
import sys
import time
from collections.abc import Sequence

import odeform
from odeform.cli import run_guarded
from odeform.errors import InputError
from odeform.geometry.shape import fit_to
from odeform.types import GaussianSplats, Geometry
from odeform_viz.session import Column

__all__ = ["main", "make_columns"]


def make_columns(checkpoint: str, compare: Sequence[str], geometry: str | None) -> list[Column]:
    """The columns that the command line asks for; a foreign shape is fitted to the first model's body."""
    predictors = [odeform.load(name) for name in (checkpoint, *compare)]
    shape: Geometry = predictors[0].rest
    if geometry:
        fit = fit_to(odeform.read_geometry(geometry), predictors[0].rest)
        shape = fit.geometry
        print(f"{geometry}: {len(shape.points)} points, scaled by {fit.factor:.4g} to the trained size")
        for note in shape.notes if isinstance(shape, GaussianSplats) else ():
            print(f"note: {geometry}: {note}", file=sys.stderr)
    labels: list[str] = []
    for predictor in predictors:
        count = sum(label.split(" #")[0] == predictor.model for label in labels)
        labels.append(predictor.model if count == 0 else f"{predictor.model} #{count + 1}")
    return [Column(label, predictor, shape) for label, predictor in zip(labels, predictors, strict=True)]


def _serve(args: argparse.Namespace) -> None:
    if args.device == "cuda":
        raise InputError("--device cuda: a motion is a state of 160 numbers, solved on the CPU; expected cpu")
    columns = make_columns(args.checkpoint, args.compare, args.geometry)
    from odeform_viz.app import App

    app = App(columns, args.host, args.port, args.record)
    print(f"ODeform {columns[0].predictor.schema.scene}: open {app.url} (Ctrl-C ends)", flush=True)
    try:
        while True:
            time.sleep(3600.0)
    finally:
        app.close()


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="odeform-viz", description="See and question learned motion.")
    parser.add_argument("--checkpoint", default="kick", metavar="CKPT", help="path or bundled name (default: kick)")
    parser.add_argument("--compare", nargs="+", default=[], metavar="CKPT", help="further models, side by side")
    parser.add_argument("--geometry", metavar="FILE", help="a mesh, points or Gaussian splats to move instead")
    parser.add_argument("--host", default="127.0.0.1", metavar="H")
    parser.add_argument("--port", type=int, default=8080, metavar="N")
    parser.add_argument("--record", metavar="FILE.rrd", help="log the session to a Rerun recording")
    parser.add_argument("--device", default="cpu", choices=("cpu", "cuda"))
    args = parser.parse_args(argv)

    def work() -> None:
        try:
            _serve(args)
        except KeyboardInterrupt:
            print("closed")

    return run_guarded(work)


if __name__ == "__main__":
    sys.exit(main())
