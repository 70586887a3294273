"""The `odeform` command."""

import argparse
import io
import json
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from odeform.errors import InputError
from odeform.formats.registry import motion_endings

__all__ = ["main", "run_guarded"]


def run_guarded(work: Callable[[], None]) -> int:
    """Exit codes of all commands: 2 and one line when the input is at fault, 130 when interrupted."""
    try:
        work()
    except (InputError, OSError) as error:
        print(f"error: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("interrupted; what was finished is kept", file=sys.stderr)
        return 130
    return 0


def parse_settings(pairs: Sequence[str]) -> dict[str, str]:
    """NAME=VALUE ... -> values as given; the schema turns them to numbers."""
    settings = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if not equals or not name:
            raise InputError(f"--set: expected NAME=VALUE, got {pair!r}")
        settings[name] = value
    return settings


def parse_window(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    try:
        begin, end = (int(part) for part in text.split(":"))
    except ValueError:
        raise InputError(f"--window: expected A:B in frames, got {text!r}") from None
    if not 0 <= begin < end:
        raise InputError(f"--window: expected 0 <= A < B, got {text!r}")
    return begin, end


def _emit(result: dict[str, Any], path: str | None) -> None:
    from odeform.io import atomic_write

    if path:
        atomic_write(Path(path), json.dumps(result, indent=1).encode())
    else:
        print(json.dumps(result, indent=1))


def _simulate(args: argparse.Namespace) -> None:
    try:
        from odeform.simulation.runner import simulate

        dataset = simulate(args.scene, args.out, args.count, args.seed, args.workers, args.rate, corners=args.corners)
    except ModuleNotFoundError as error:
        raise InputError(f"simulation needs {error.name}: pip install 'odeform[simulate]'") from None
    failed = [entry.name for entry in dataset.entries if entry.status != "ok"]
    print(f"{len(dataset.entries) - len(failed)} sequences in {args.out}; failed: {', '.join(failed) or 'none'}")


def _import(args: argparse.Namespace) -> None:
    from odeform.dataset.importers.importing import import_dataset

    dataset = import_dataset(args.source, args.out, args.rate, args.seed)
    failed = [entry.name for entry in dataset.entries if entry.status != "ok"]
    counts = ", ".join(f"{len(dataset.select(split))} {split}" for split in ("train", "val", "test"))
    varied = ", ".join(p.name for p in dataset.schema.parameters)
    print(f"{dataset.schema.scene} in {args.out}: {counts}; {varied} vary; failed: {', '.join(failed) or 'none'}")


def _pack(args: argparse.Namespace) -> None:
    from odeform.dataset.packed import SUFFIX, pack
    from odeform.dataset.store import open_dataset

    out = Path(args.out)
    if out.suffix != SUFFIX:
        raise InputError(f"--out: expected a name ending in {SUFFIX}, got {args.out!r}")
    took = pack(open_dataset(args.dataset), out, 1e-3 * args.tolerance)
    print(
        f"{out}: {out.stat().st_size / 1e6:.2f} MB, {took['modes']} modes, RMSE of a sequence at most "
        f"{1e3 * took['largest_rmse_m']:.4f} mm, error of a vertex at most {1e3 * took['largest_error_m']:.3f} mm"
    )


def _train(args: argparse.Namespace) -> None:
    from odeform.dataset.store import open_dataset
    from odeform.training.train import train

    dataset = open_dataset(args.dataset)
    window = parse_window(args.window)
    chosen = {name: getattr(args, name) for name in ("minutes", "steps", "seed", "every", "stagger", "resume")}
    train(dataset, args.out, args.model, window=window, **chosen)


def _evaluate(args: argparse.Namespace) -> None:
    from odeform.dataset.store import open_dataset
    from odeform.evaluation.metrics import evaluate
    from odeform.models.registry import load

    dataset, window = open_dataset(args.data), parse_window(args.window)
    models = {}
    for name in args.checkpoints:
        predictor = load(name)
        taught = predictor.checkpoint.provenance.get("fixed")
        if taught is not None and taught != dataset.fixed:
            print(f"note: {name} was trained on other physics: {taught}, not {dataset.fixed}", file=sys.stderr)
        key = predictor.model if predictor.model not in models else name
        models[key] = evaluate(predictor, dataset, args.split, window, args.quality)
    result = {"data": args.data, "split": args.split, "window": window, "models": models}
    if args.json:
        _emit(result, args.json)
    columns = ("rmse_pooled_mm", "rmse_mm", "mae_mm", "relative", "deformation_relative", "off_grid_rmse_mm")
    rows = dict(models)
    rows |= {f"{key} (impact)": scores["impact"] for key, scores in models.items() if "impact" in scores}
    print(f"{'model':<24}" + "".join(f"{column:>22}" for column in columns))
    for key, scores in rows.items():
        cells = ("-" if scores[column] is None else f"{scores[column]:.4g}" for column in columns)
        print(f"{key:<24}" + "".join(f"{cell:>22}" for cell in cells))


def _identify(args: argparse.Namespace) -> None:
    from odeform.dataset.store import open_dataset
    from odeform.identification.observation import View
    from odeform.identification.table import identify_split, report
    from odeform.models.registry import load

    if args.limit is not None and args.limit < 1:
        raise InputError(f"--limit: expected a positive number, got {args.limit}")
    view = View(args.points, args.frames, args.noise, args.seed)
    result = identify_split(load(args.checkpoint), open_dataset(args.data), args.split, args.limit, view)
    if args.json:
        _emit(result, args.json)
    print(report(result))


def _predict(args: argparse.Namespace) -> None:
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
        print(f"note: {args.checkpoint}: {predictor.schema.notes[-1]}", file=sys.stderr)
    elif args.geometry is not None:
        shape, region = read_shape(args.geometry)
        fit = fit_to(shape, predictor.rest, region, transform=None if predictor.rescales_input else Similarity())
    geometry = fit.geometry if fit else None
    for note in geometry.notes if isinstance(geometry, GaussianSplats) else ():
        print(f"note: {args.geometry}: {note}", file=sys.stderr)
    motion = predictor.solve(geometry, parse_settings(args.set), args.quality, until=float(times[-1]))
    write_motion(motion, times, args.out, fit)
    for name in motion.outside:
        print(f"note: {name} = {motion.parameters[name]:g} is outside the trained range", file=sys.stderr)
    print(f"{len(times)} frames of {len(motion.geometry.points)} points to {args.out}; status {motion.stats.status}")


def _info(args: argparse.Namespace) -> None:
    from odeform.models.registry import open_checkpoint

    checkpoint = open_checkpoint(args.checkpoint)
    config = {k: v for k, v in checkpoint.config.items() if k != "trials"}
    result = {
        "schema": checkpoint.schema.to_json(),
        "model": checkpoint.model,
        "size_bytes": checkpoint.size_bytes,
        "numbers": sum(int(array.size) for array in checkpoint.arrays.values()),
        "config": config,
        "provenance": checkpoint.provenance,
        "scores": {k: v for k, v in checkpoint.scores.items() if k != "per_frame_rmse_mm"},
        "sha256": checkpoint.sha256,
    }
    _emit(result, args.json)


def _bench(args: argparse.Namespace) -> None:
    from odeform.benchmark.bench import bench, report

    result = bench(args.checkpoint, args.data)
    if args.json:
        _emit(result, args.json)
    print(report(result))


def _stress(args: argparse.Namespace) -> None:
    from odeform.stress.stress import report, stress

    if args.cases < 1:
        raise InputError(f"--cases: expected a positive number, got {args.cases}")
    if args.map:
        from odeform.io import atomic_write
        from odeform.models.registry import load_continuous
        from odeform.stress.stability import map_image, stability_map

        picture = io.BytesIO()
        map_image(stability_map(load_continuous(args.checkpoint))).save(picture, format="PNG", optimize=True)
        atomic_write(Path(args.map), picture.getvalue())
    result = stress(args.checkpoint, args.cases)
    if args.json:
        _emit(result, args.json)
    print(report(result))


Command = Callable[[str, Callable[[argparse.Namespace], None], str], argparse.ArgumentParser]


def _tables(args: argparse.Namespace) -> None:
    from odeform.tables.tables import tables

    if not 0.0 < args.share < float("inf") or args.jobs < 1:
        raise InputError("--share and --jobs: expected positive numbers")
    tables(Path(args.keep), Path(args.out), args.share, args.jobs, args.kept_only)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="odeform", description="Learned continuous motion of soft bodies.")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def command(name: str, run: Callable[[argparse.Namespace], None], text: str) -> argparse.ArgumentParser:
        sub = commands.add_parser(name, help=text, description=text)
        sub.set_defaults(run=run)
        return sub

    _add_makers(command)
    _add_askers(command)
    return parser


def _add_makers(command: Command) -> None:
    """Commands that make data sets and checkpoints."""
    sub = command("simulate", _simulate, "simulate a data set of a scene (needs odeform[simulate])")
    sub.add_argument("scene", metavar="SCENE", help="mass-elastic or kick")
    sub.add_argument("--out", required=True, metavar="DIR")
    sub.add_argument("--count", type=int, metavar="N", help="sequences (default: the scene's)")
    sub.add_argument("--seed", type=int, default=0, metavar="S")
    sub.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="W")
    sub.add_argument("--rate", type=float, metavar="HZ", help="frames a second (default: the scene's)")
    sub.add_argument("--corners", action="store_true", help="also the corners of the trained box, for training")

    sub = command("import", _import, "bring in the released data, or a folder of mesh frames")
    sub.add_argument("source", metavar="SRC", help="the released layout, or a folder a sequence and parameters.csv")
    sub.add_argument("--out", required=True, metavar="DIR")
    sub.add_argument("--rate", type=float, metavar="HZ", help="of mesh frames, where the table does not say")
    sub.add_argument("--seed", type=int, default=0, metavar="S", help="draws the splits of a source without any")

    sub = command("pack", _pack, "write a small compressed copy of a data set")
    sub.add_argument("dataset", metavar="DATASET")
    sub.add_argument("--out", required=True, metavar="FILE")
    sub.add_argument("--tolerance", type=float, default=0.02, metavar="MM", help="largest error of a vertex (0.02)")

    sub = command("train", _train, "train a model on a data set and score it on the test split")
    sub.add_argument("dataset", metavar="DATASET")
    sub.add_argument("--out", required=True, metavar="FILE")
    sub.add_argument(
        "--model",
        default="odeform",
        metavar="NAME",
        help="odeform (default), odeform-per-point, node, rnn, direct, occupancy-flow, pod-rbf, nearest",
    )
    sub.add_argument("--window", metavar="A:B", help="frames to train on, half-open")
    sub.add_argument("--every", type=int, default=1, metavar="K", help="train on every k-th frame")
    sub.add_argument("--stagger", action="store_true", help="not on the same frames of all sequences: they interleave")
    sub.add_argument("--seed", type=int, default=0, metavar="S")
    sub.add_argument(
        "--minutes", type=float, default=30.0, metavar="M", help="of processor time (default 30), trials included"
    )
    sub.add_argument("--steps", type=int, metavar="N", help="so many steps of training instead: repeatable")
    sub.add_argument("--resume", action="store_true", help="continue an interrupted training (FILE.part)")

    sub = command("tables", _tables, "train every model of the paper's tables and write them as a page; resumable")
    sub.add_argument("--keep", required=True, metavar="DIR", help="where checkpoints and scores are kept")
    sub.add_argument("--out", required=True, metavar="FILE.md")
    sub.add_argument("--share", type=float, default=1.0, metavar="X", help="of the planned steps of trainings (1)")
    sub.add_argument("--jobs", type=int, default=os.cpu_count() or 1, metavar="N", help="trainings at a time")
    sub.add_argument("--kept-only", action="store_true", help="train nothing; leave open what is not kept")


def _add_askers(command: Command) -> None:
    """Commands that ask something of checkpoints."""
    sub = command("evaluate", _evaluate, "score checkpoints on a data set")
    sub.add_argument("checkpoints", nargs="+", metavar="CKPT")
    sub.add_argument("--data", required=True, metavar="DATASET")
    sub.add_argument("--split", default="test", choices=("train", "val", "test", "all"))
    sub.add_argument("--window", metavar="A:B", help="frames to score, half-open")
    sub.add_argument("--quality", default="balanced", metavar="NAME", help="draft, balanced (default), reference")
    sub.add_argument("--json", metavar="FILE")

    sub = command("predict", _predict, "predict one motion and write it to a file")
    sub.add_argument("checkpoint", metavar="CKPT")
    sub.add_argument("--out", required=True, metavar="FILE", help=motion_endings())
    sub.add_argument(
        "--geometry", metavar="FILE", help="a mesh, points or splats (bundled: volleyball), moved as the body"
    )
    sub.add_argument("--set", nargs="*", action="extend", default=[], metavar="NAME=VALUE")
    sub.add_argument("--times", metavar="START:STOP:STEP", help="seconds, half-open (default: the trained frames)")
    sub.add_argument("--quality", default="balanced", metavar="NAME")

    sub = command("identify", _identify, "recover the parameters of observed motions, all together, with intervals")
    sub.add_argument("checkpoint", metavar="CKPT")
    sub.add_argument("--data", required=True, metavar="DATASET")
    sub.add_argument("--split", default="test", choices=("train", "val", "test", "all"))
    sub.add_argument("--limit", type=int, metavar="N", help="the first N sequences only")
    sub.add_argument("--points", type=int, metavar="N", help="see N random points of the surface (default: vertices)")
    sub.add_argument("--frames", type=int, metavar="K", help="see K random frames (default: all)")
    sub.add_argument("--noise", type=float, default=0.0, metavar="MM", help="add noise to each coordinate (0)")
    sub.add_argument("--seed", type=int, default=0, metavar="S", help="of what is drawn (0)")
    sub.add_argument("--json", metavar="FILE")

    sub = command("bench", _bench, "measure speed against accuracy on this machine, beside other models and solvers")
    sub.add_argument("checkpoint", nargs="?", default="kick", metavar="CKPT")
    sub.add_argument("--data", metavar="DATASET", help="the truth (default: the scene's bundled data set, if any)")
    sub.add_argument("--json", metavar="FILE")

    sub = command("stress", _stress, "ask a model for the extremes and check what it then shows")
    sub.add_argument("checkpoint", nargs="?", default="kick", metavar="CKPT")
    sub.add_argument("--cases", type=int, default=20_000, metavar="N", help="distinct draws, at least (20000)")
    sub.add_argument("--map", metavar="FILE.png", help="where it is stable, over two parameters and time, as a picture")
    sub.add_argument("--json", metavar="FILE")

    sub = command("info", _info, "print what a checkpoint holds")
    sub.add_argument("checkpoint", metavar="CKPT")
    sub.add_argument("--json", metavar="FILE")


def main(argv: Sequence[str] | None = None) -> int:
    args = _parser().parse_args(argv)
    return run_guarded(lambda: args.run(args))


if __name__ == "__main__":
    sys.exit(main())
