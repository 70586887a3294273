"""Benchmarks of the viewer: `python -m odeform_figures.viewer_benchmark`."""

import argparse
import math
import os
import sys
import tempfile
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import odeform
from odeform.checkpoint import bundled_checkpoints
from odeform.cli import run_guarded
from odeform.dataset.store import bundled_datasets, open_dataset
from odeform.models.base import Predictor
from odeform.models.reduced_model import ReducedModel
from odeform_figures.viewer_benchmark.clicks import click
from odeform_figures.viewer_benchmark.fits import drag_while_fitting
from odeform_figures.viewer_benchmark.latency import drag, play_free_flight, scrub_splats
from odeform_figures.viewer_benchmark.lessons import drag_while_teaching
from odeform_figures.viewer_benchmark.recording import record_playback
from odeform_figures.viewer_benchmark.soak import soak
from odeform_figures.viewer_benchmark.stages import stages
from odeform_viz.app import App
from odeform_viz.columns import Column, truth_column
from odeform_viz.pushing import contacts_of

COLUMNS = (2, 5, 8)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m odeform_figures.viewer_benchmark",
        description="Measure the latency of the viewer, from the message of a slider to the message that answers it.",
    )
    parser.add_argument("--checkpoint", default="kick", metavar="CKPT", help="path or bundled name (default: kick)")
    parser.add_argument("--messages", type=int, default=300, metavar="N", help="messages of each drag (default: 300)")
    parser.add_argument(
        "--columns",
        type=int,
        nargs="+",
        metavar="N",
        help="instead, only drag a slider with N columns of the model side by side, 2,500 points each",
    )
    parser.add_argument(
        "--soak",
        type=int,
        nargs="?",
        const=10_000,
        metavar="N",
        help="instead, send N random inputs to all controls (10000 if N is left out) from two browsers, in ten parts, "
        "with simulations, fits, uploads, recordings, downloads and closed tabs in between; report errors and memory; "
        "exit code 1 for an error, a stale frame, or memory that grows by 5 %% after warm-up",
    )
    parser.add_argument(
        "--minutes", type=float, metavar="M", help="with --soak: go on with parts of the same size for M minutes"
    )
    parser.add_argument(
        "--recording",
        type=float,
        nargs="?",
        const=60.0,
        metavar="S",
        help="instead, record S seconds of playback of 5,000 points (60 if S is left out), and report size and replay",
    )
    parser.add_argument(
        "--fit", action="store_true", help="instead, drag a slider while a test sequence is fitted again and again"
    )
    parser.add_argument(
        "--teach",
        type=Path,
        metavar="FILE",
        help="instead, load the mesh in FILE, teach it to the model, and drag the slider of the force meanwhile",
    )
    parser.add_argument(
        "--motions", type=int, choices=(10, 20, 40), default=10, help="with --teach: simulated motions (default: 10)"
    )
    parser.add_argument("--browser", action="store_true", help="with --teach: Chromium shows the page meanwhile")
    return parser


def _print_recording(model: Predictor, origin: str, seconds: float) -> None:
    with tempfile.TemporaryDirectory(prefix="odeform-") as folder:
        for key, value in record_playback(model, origin, seconds, 5000, Path(folder)).items():
            print(f"  {key:<16} {value:.6g}")


def _columns(model: Predictor, counts: Iterable[int], messages: int) -> dict[str, Callable[[], dict[str, float]]]:
    return {
        f"{count} columns, 2,500 points": lambda n=count: drag([model] * n, None, messages, 2500) for count in counts
    }


def _print_runs(runs: dict[str, Callable[[], dict[str, float]]]) -> None:
    print(f"load of this machine before: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    for name, run in runs.items():
        print(name)
        for key, value in run().items():
            print(f"  {key:<16} {value:.6g}")


def _print_latencies(models: list[Predictor], truth: Column | None, messages: int) -> None:
    model = models[0]
    if contacts_of(model.schema):
        print("click to new motion")
        for key, value in click(model, messages).items():
            print(f"  {key:<16} {value:.6g}")
        return
    together = f"{len(models)} models{' and truth' * (truth is not None)}, 2,500 points"
    runs: dict[str, Callable[[], dict[str, float]]] = {
        "one model, 5,000 points": lambda: drag([model], None, messages, 5000),
        # the last one is measured: a model whose every answer differs, which nearest's do not
        together: lambda: drag([*models[1:], model], truth, messages, 2500),
    }
    runs |= _columns(model, COLUMNS, messages)
    runs["time of 100,000 splats"] = lambda: scrub_splats(model, messages)
    runs["time of 100,000 splats, by stage"] = lambda: stages(model, messages)
    if model.schema.impact:
        runs["free flight"] = lambda: play_free_flight(model)
    _print_runs(runs)


def _soak(models: list[Predictor], truth: Column | None, requests: int, minutes: float | None) -> bool:
    """Print the result of a soak test; returns whether it passed."""
    scene = models[0].schema.scene
    columns = [Column(models[0].model, models[0], models[0].rest, origin=scene)]
    columns += [Column(m.model, m, m.rest, origin=f"{scene}/{m.model}") for m in models[1:2]]
    with tempfile.TemporaryDirectory(prefix="odeform-") as folder:
        app = App([*columns, truth] if truth is not None else columns, port=0, workspace=folder)
        try:
            result = soak(app, requests, Path(folder), minutes=minutes, report=lambda line: print(line, flush=True))
        finally:
            app.close()
    print(f"{result.requests} requests in {result.wall_s:.0f} s, {result.refused} refused, {len(result.errors)} errors")
    newest = [seconds for seconds in result.newest_s if math.isfinite(seconds)]
    slowest = f", at most {max(newest):.2f} s after a drag" if newest else ""
    print(f"newest frame shown last in every browser: {len(newest)} of {len(result.newest_s)} times{slowest}")
    resident = ", ".join(f"{mb:.0f}" for mb in result.resident_mb)
    print(f"resident MB after each part: {resident}")
    warm, last = result.memory
    print(f"memory after warm-up {warm:.0f} MB, at the end {last:.0f} MB: {result.growth:+.1%}")
    if result.allocated is not None:
        print("of that allocated {:.0f} MB, at the end {:.0f} MB".format(*result.allocated))
    for error in dict.fromkeys(result.errors):
        print(error)
    print("passed" if result.passed else "missed: expected no error, the newest frame last, and less growth than 5 %")
    return result.passed


def main() -> int:
    """Run the command; returns its exit code."""
    args = _parser().parse_args()
    passed = True

    def work() -> None:
        nonlocal passed
        model = odeform.load(args.checkpoint)
        if args.recording:
            _print_recording(model, args.checkpoint, args.recording)
            return
        if args.teach:
            taught = partial(drag_while_teaching, model, args.checkpoint, args.teach, args.motions, args.browser)
            _print_runs({f"{args.teach.name}, taught by {args.motions} motions": taught})
            return
        if args.columns:
            _print_runs(_columns(model, args.columns, args.messages))
            return
        scene = model.schema.scene
        bundled = [odeform.load(path) for name, path in bundled_checkpoints().items() if name.startswith(f"{scene}/")]
        # not models that move each point separately: they take seconds for thousands of points
        others = [m for m in bundled if isinstance(m, ReducedModel) and m.model != model.model]
        models: list[Predictor] = [model, *others][:3]
        truth = None
        if scene in bundled_datasets():
            truth = truth_column(f"{scene}/{open_dataset(scene).select('test')[0].name}")
        if args.fit and truth is not None:
            _print_runs({"one model and truth, fitted": lambda: drag_while_fitting(model, truth, args.messages)})
        elif args.soak:
            passed = _soak(models, truth, args.soak, args.minutes)
        else:
            _print_latencies(models, truth, args.messages)

    return run_guarded(work) or int(not passed)


if __name__ == "__main__":
    sys.exit(main())
