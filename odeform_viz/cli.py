"""The `odeform-viz` command."""

import argparse
import sys
import time
from collections.abc import Sequence as Several

import odeform
from odeform.cli import run_guarded
from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.geometry.shape import fit_to
from odeform.types import Geometry, Sequence
from odeform_viz.columns import Column

__all__ = ["main", "make_columns", "open_sequence"]


def make_columns(checkpoint: str, compare: Several[str], geometry: str | None) -> list[Column]:
    """The columns that the command line asks for; a foreign shape is fitted to the first model's body."""
    predictors = [odeform.load(name) for name in (checkpoint, *compare)]
    shape: Geometry = predictors[0].rest
    if geometry:
        fit = fit_to(odeform.read_geometry(geometry), predictors[0].rest)
        shape = fit.geometry
        print(f"{geometry}: {len(shape.points)} points, scaled by {fit.factor:.4g} to the trained size")
    return [Column(predictor.model, predictor, shape, foreign=geometry is not None) for predictor in predictors]


def open_sequence(path: str) -> Sequence:
    """A sequence by its path, DATASET/NAME: of a folder, of a packed file, or of a scene's bundled copy."""
    root, _, name = path.rpartition("/")
    dataset = open_dataset(root or ".")
    entry = next((e for e in dataset.select("all") if e.name == name.removesuffix(".npz")), None)
    if entry is None:
        raise InputError(f"--sequence {path}: {dataset.root} has no sequence {name!r}")
    return dataset.read(entry)


def _serve(args: argparse.Namespace) -> None:
    if args.device == "cuda":
        raise InputError("--device cuda: a motion is a state of 160 numbers, solved on the CPU; expected cpu")
    columns = make_columns(args.checkpoint, args.compare, args.geometry)
    sequence = open_sequence(args.sequence) if args.sequence else None
    from odeform_viz.app import App

    app = App(columns, args.host, args.port, args.record, sequence)
    print(f"ODeform {columns[0].source.schema.scene}: open {app.url} (Ctrl-C ends)", flush=True)
    try:
        while True:
            time.sleep(3600.0)
    finally:
        app.close()


def main(argv: Several[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="odeform-viz", description="See and question learned motion.")
    parser.add_argument("--checkpoint", default="kick", metavar="CKPT", help="path or bundled name (default: kick)")
    parser.add_argument("--compare", nargs="+", default=[], metavar="CKPT", help="further models, side by side")
    parser.add_argument("--geometry", metavar="FILE", help="a mesh, points or Gaussian splats to move instead")
    parser.add_argument("--sequence", metavar="PATH", help="show a sequence of a data set as truth: DATASET/NAME")
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
