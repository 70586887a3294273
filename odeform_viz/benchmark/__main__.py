"""Benchmarks of the viewer: `python -m odeform_viz.benchmark`."""

import argparse
import math
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import odeform
from odeform.checkpoint import bundled_checkpoints
from odeform.cli import run_guarded
from odeform.dataset.store import bundled_datasets, open_dataset
from odeform.models.base import Predictor
from odeform.models.reduced_model import ReducedModel
from odeform_viz.app import App
from odeform_viz.benchmark.latency import drag, play_free_flight, scrub_splats
from odeform_viz.benchmark.soak import soak
from odeform_viz.benchmark.stages import stages
from odeform_viz.columns import Column, truth_column

COLUMNS = (2, 4, 8)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m odeform_viz.benchmark",
        description="Measure the latency of the viewer, from the message of a slider to the message that answers it.",
    )
    parser.add_argument("--checkpoint", default="kick", metavar="CKPT", help="path or bundled name (default: kick)")
    parser.add_argument("--messages", type=int, default=300, metavar="N", help="messages of each drag (default: 300)")
    parser.add_argument(
        "--soak",
        type=int,
        nargs="?",
        const=10_000,
        metavar="N",
        help="instead, send N random inputs to all controls (10000 if N is left out), and report errors and memory",
    )
    return parser


def _print_latencies(models: list[Predictor], truth: Column | None, messages: int) -> None:
    model = models[0]
    together = f"{len(models)} models{' and truth' * (truth is not None)}, 2,500 points"
    runs: dict[str, Callable[[], dict[str, float]]] = {
        "one model, 5,000 points": lambda: drag([model], None, messages, 5000),
        # the last one is measured: a model whose every answer differs, which nearest's do not
        together: lambda: drag([*models[1:], model], truth, messages, 2500),
    }
    for count in COLUMNS:
        runs[f"{count} columns, 2,500 points"] = lambda n=count: drag([model] * n, None, messages, 2500)
    runs["time of 100,000 splats"] = lambda: scrub_splats(model, messages)
    runs["time of 100,000 splats, by stage"] = lambda: stages(model, messages)
    if model.schema.impact:
        runs["free flight"] = lambda: play_free_flight(model)
    for name, run in runs.items():
        print(name)
        for key, value in run().items():
            print(f"  {key:<16} {value:.6g}")


def _print_soak(models: list[Predictor], truth: Column | None, requests: int) -> None:
    scene = models[0].schema.scene
    columns = [Column(models[0].model, models[0], models[0].rest, origin=scene)]
    columns += [Column(m.model, m, m.rest, origin=f"{scene}/{m.model}") for m in models[1:2]]
    app = App([*columns, truth] if truth is not None else columns, port=0)
    try:
        with tempfile.TemporaryDirectory(prefix="odeform-") as folder:
            result = soak(app, requests, Path(folder))
    finally:
        app.close()
    print(f"{result.requests} inputs in {result.wall_s:.0f} s, {result.refused} refused, {len(result.errors)} errors")
    newest = [seconds for seconds in result.newest_s if math.isfinite(seconds)]
    slowest = f", at most {max(newest):.2f} s after a drag" if newest else ""
    print(f"newest frame shown last: {len(newest)} of {len(result.newest_s)} times{slowest}")
    resident = ", ".join(f"{mb:.0f}" for mb in result.resident_mb)
    print(f"resident MB after each tenth: {resident}: {result.growth:+.1%}")
    for error in dict.fromkeys(result.errors):
        print(error)


def main() -> int:
    """Run the command; returns its exit code."""
    args = _parser().parse_args()

    def work() -> None:
        model = odeform.load(args.checkpoint)
        scene = model.schema.scene
        bundled = [odeform.load(path) for name, path in bundled_checkpoints().items() if name.startswith(f"{scene}/")]
        # not models that move each point separately: they take seconds for thousands of points
        others = [m for m in bundled if isinstance(m, ReducedModel) and m.model != model.model]
        models: list[Predictor] = [model, *others][:3]
        truth = None
        if scene in bundled_datasets():
            truth = truth_column(f"{scene}/{open_dataset(scene).select('test')[0].name}")
        if args.soak:
            _print_soak(models, truth, args.soak)
        else:
            _print_latencies(models, truth, args.messages)

    return run_guarded(work)


if __name__ == "__main__":
    sys.exit(main())
