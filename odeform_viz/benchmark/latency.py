"""How long the viewer takes from a slider's message to what answers it: `python -m odeform_viz.benchmark.latency`."""

import argparse
import contextlib
import io
import itertools
import math
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
import viser

import odeform
from odeform.benchmark.probes import ball, round_splats
from odeform.benchmark.timing import milliseconds
from odeform.checkpoint import bundled_checkpoints
from odeform.dataset.store import bundled_datasets, open_dataset
from odeform.models.base import Predictor
from odeform.models.reduced_model import ReducedModel
from odeform.types import Floats
from odeform_viz.app import App
from odeform_viz.benchmark.client import LoopbackClient
from odeform_viz.benchmark.soak import soak
from odeform_viz.columns import Column, Columns, truth_column
from odeform_viz.rendering.checkerboard import checkerboard_parts
from odeform_viz.rendering.scene import SceneView
from odeform_viz.session import Session
from odeform_viz.view import DisplayOptions, ViewRequest

__all__ = ["drag", "fly", "scrub_splats", "stages"]

RATE = 20.0  # Hz; a browser sends a slider no more often
SPLATS = 100_000
COLUMNS = (2, 4, 8)


@contextlib.contextmanager
def _serving(columns: list[Column], port: int, moment: float) -> Iterator[LoopbackClient]:
    """A client of a viewer with these columns, paused at a moment."""
    app = App(columns, port=port)
    try:
        with LoopbackClient(port) as client:
            client.set("time (s)", moment)
            client.collect(1.0)
            yield client
    finally:
        app.close()


def _answers(
    values: Floats, send: Callable[[float], None], wait: Callable[[float], int | None], rate: float
) -> dict[str, float]:
    """Send one value after the other; `wait` gives the index of the request that the next answer serves.

    A request's latency runs to the first answer that serves it or a newer one. `out_of_order` counts answers to older
    requests than the one before, `stale_last` whether the last answer was not to the last request.
    """
    sent, latency, order = np.zeros(len(values)), np.full(len(values), np.nan), []

    def listen(until: float) -> None:
        while (left := until - time.perf_counter()) > 0.0:
            served = wait(left)
            if served is not None:
                order.append(served)
                waiting = np.isnan(latency[: served + 1])
                latency[: served + 1][waiting] = time.perf_counter() - sent[: served + 1][waiting]

    for index, value in enumerate(values):
        sent[index] = time.perf_counter()
        send(float(value))
        listen(sent[index] + 1.0 / rate)
    listen(time.perf_counter() + 1.0)
    return {
        "messages": len(values),
        "answers": len(order),
        "p50_ms": 1e3 * float(np.percentile(latency, 50)),
        "p95_ms": 1e3 * float(np.percentile(latency, 95)),
        "out_of_order": int((np.diff(order) < 0).sum()),
        "stale_last": int(order[-1] != len(values) - 1),
    }


def drag(models: list[Predictor], truth: Column | None, port: int, messages: int, points: int) -> dict[str, float]:
    """Drag a physical slider under models side by side, with the truth of a sequence beside them or without.

    Answers are the vertices of the last model, which are sent last. Each request asks for a value of its own, so that
    an answer tells which one it serves.
    """
    model = models[-1]
    shape = ball(points, model)
    slider = model.schema.parameters[0]
    values, moment = np.linspace(slider.low, slider.high, messages), 0.3 if model.schema.impact else 0.02
    columns = [Column(m.model, m, shape) for m in models]
    columns = [*columns[:1], truth, *columns[1:]] if truth is not None else columns
    # what is sent last
    parts = checkerboard_parts(shape)
    node = f"/world/column_{len(columns) - 1}/body/part_{len(parts) - 1}"
    others = truth.source.parameters if truth is not None and truth.truth else {}  # pyright: ignore[reportAttributeAccessIssue]
    motions = (model.solve(shape, {**others, slider.name: v}) for v in values)
    expected = np.stack([parts[-1].vertices(motion.deformed(moment))[0] for motion in motions])

    with _serving(columns, port, moment) as client:

        def wait(seconds: float) -> int | None:
            vertices = client.wait_vertices(node, seconds)
            return None if vertices is None else int(np.abs(expected - vertices[0]).sum(axis=1).argmin())

        return _answers(values, lambda v: client.set(f"{slider.name} ({slider.unit})", v), wait, RATE)


def _scrub(model: Predictor, messages: int) -> Floats:
    """Moments about that of the largest deformation."""
    return (0.288 if model.schema.impact else 0.005) + np.linspace(0.0, 0.025, messages)


def scrub_splats(model: Predictor, port: int, messages: int) -> dict[str, float]:
    """Scrub the time of 100,000 splats with their covariances through the moments of the largest deformation."""
    splats, values = round_splats(SPLATS, model), _scrub(model, messages)
    begin, motion = float(values[0]), model.solve(splats)
    expected = np.array([motion.deformed(float(v))[0] for v in np.round(values, 4)])

    with _serving([Column("splats", model, splats)], port, begin) as client:

        def wait(seconds: float) -> int | None:
            centers = client.wait_splats("/world/column_0/body/splats", seconds)
            return None if centers is None else int(np.abs(expected - 0.01 * centers[0]).sum(axis=1).argmin())

        return _answers(values, lambda v: client.set("time (s)", round(v, 4)), wait, 10.0)


def stages(model: Predictor, port: int, messages: int) -> dict[str, float]:
    """The same without a client: from the request to a frame of arrays, and from there to messages for the socket."""
    splats, session = round_splats(SPLATS, model), Session(model.schema)
    columns = Columns.of([Column("splats", model, splats)]).all
    requests = [ViewRequest(model.schema.complete({}), float(t), "balanced", columns) for t in _scrub(model, messages)]
    with contextlib.redirect_stdout(io.StringIO()):  # viser prints a banner of its own
        server = viser.ViserServer(port=port, verbose=False)
    try:
        view = SceneView(server, 0.2, 1)
        view.publish(session.frame(requests[0]), DisplayOptions(), None)
        compute = milliseconds(lambda i: session.frame(requests[i]), messages - 3)
        frames = itertools.cycle([session.frame(request) for request in requests[:: messages // 10]])
        pack = milliseconds(lambda _: view.publish(next(frames), DisplayOptions(), None), messages)
    finally:
        server.stop()
    return {"compute_p50_ms": float(np.median(compute)), "pack_p50_ms": float(np.median(pack))}


def fly(model: Predictor, port: int) -> dict[str, float]:
    """Play the free flight before an impact, ten times slower, for two seconds: bytes on the wire by frame."""
    assert model.schema.impact is not None
    with _serving([Column(model.model, model, model.rest)], port, 0.02) as client:
        client.set("speed", "1/10")
        client.collect(0.5)
        begin = client.received
        client.press("Play or pause")
        messages = client.collect(2.0)
        frames = sum(m["type"] == "SetPositionMessage" and m["name"].endswith("/body") for m in messages)
        return {"frames": frames, "bytes_a_frame": (client.received - begin) / frames}


def _soak(model: Predictor, rivals: list[Predictor], truth: Column | None, port: int, requests: int) -> None:
    origins = [(model, model.schema.scene), *((r, f"{model.schema.scene}/{r.model}") for r in rivals[:1])]
    columns = [Column(m.model, m, m.rest, origin=name) for m, name in origins]
    app = App([*columns, truth] if truth is not None else columns, port=port)
    try:
        with tempfile.TemporaryDirectory(prefix="odeform-") as folder:
            done = soak(app, port, requests, Path(folder))
    finally:
        app.close()
    print(f"{done.requests} requests in {done.wall_s:.0f} s, {done.refused} refused, {len(done.errors)} errors")
    shown = [seconds for seconds in done.newest_s if math.isfinite(seconds)]
    slowest = f", {max(shown):.2f} s after a drag at most" if shown else ""
    print(f"newest frame last: {len(shown)} of {len(done.newest_s)} times{slowest}")
    print(f"resident MB after each tenth: {', '.join(f'{mb:.0f}' for mb in done.resident_mb)}: {done.growth:+.1%}")
    for error in dict.fromkeys(done.errors):
        print(error)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m odeform_viz.benchmark.latency", description=__doc__)
    parser.add_argument("--checkpoint", default="kick")
    parser.add_argument("--messages", type=int, default=300)
    parser.add_argument("--port", type=int, default=8097)
    parser.add_argument(
        "--soak", type=int, nargs="?", const=10_000, metavar="N", help="random requests, default 10,000"
    )
    args = parser.parse_args()
    model = odeform.load(args.checkpoint)
    scene = model.schema.scene
    bundled = [odeform.load(path) for name, path in bundled_checkpoints().items() if name.startswith(f"{scene}/")]
    # models of points take seconds for thousands of them
    rivals: list[Predictor] = [r for r in bundled if isinstance(r, ReducedModel) and r.model != model.model]
    models = [model, *rivals][:3]
    truth = None
    if scene in bundled_datasets():
        truth = truth_column(f"{scene}/{open_dataset(scene).select('test')[0].name}")
    if args.soak:
        _soak(model, rivals, truth, args.port, args.soak)
        return
    runs = {
        "one model, 5,000 points": lambda: drag([model], None, args.port, args.messages, 5000),
        f"{len(models)} models{' and truth' * (truth is not None)}, 2,500 points": lambda: drag(
            models, truth, args.port, args.messages, 2500
        ),
        **{
            f"{n} columns, 2,500 points": partial(drag, [model] * n, None, args.port, args.messages, 2500)
            for n in COLUMNS
        },
        "time, 100,000 splats": lambda: scrub_splats(model, args.port, args.messages),
        "time, 100,000 splats, its stages": lambda: stages(model, args.port, args.messages),
    }
    if model.schema.impact:
        runs["free flight"] = lambda: fly(model, args.port)
    for name, run in runs.items():
        print(name)
        for key, value in run().items():
            print(f"  {key:<14} {value:.6g}")


if __name__ == "__main__":
    sys.exit(main())
