"""Latency of the viewer: from the message of a slider to the message that answers it, through the protocol."""

import contextlib
import time
from collections.abc import Callable, Iterator

import numpy as np

from odeform.benchmark.probes import round_mesh, round_splats
from odeform.models.base import Predictor
from odeform.types import Floats
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.columns import Column
from odeform_viz.rendering.checkerboard import checkerboard_parts

__all__ = [
    "DRAG_RATE",
    "SPLATS",
    "drag",
    "largest_deformation_times",
    "latencies",
    "measure",
    "play_free_flight",
    "scrub_splats",
    "served",
]

DRAG_RATE = 20.0  # Hz; browsers send slider values no faster
SCRUB_RATE = 10.0  # Hz
SPLATS = 100_000


def drag(models: list[Predictor], truth: Column | None, messages: int, points: int) -> dict[str, float]:
    """Measures the latency of dragging the first slider, with all models on a round mesh of `points`, and the truth if
    given.

    The answers are the vertices of the last column, which are sent last. Every message asks for another value, so an
    answer tells which message it serves.
    """
    model = models[-1]
    shape = round_mesh(points, model)
    slider = model.schema.parameters[0]
    values, moment = np.linspace(slider.low, slider.high, messages), 0.3 if model.schema.impact else 0.02
    columns = [Column(m.model, m, shape) for m in models]
    columns = [*columns[:1], truth, *columns[1:]] if truth is not None else columns
    parts = checkerboard_parts(shape)
    node = f"/world/column_{len(columns) - 1}/body/part_{len(parts) - 1}"
    others = truth.truth.parameters if truth is not None and truth.truth is not None else {}
    motions = (model.solve(shape, {**others, slider.name: v}) for v in values)
    expected = np.stack([parts[-1].vertices(motion.deformed(moment))[0] for motion in motions])

    with served(columns, moment) as client:

        def wait(seconds: float) -> int | None:
            vertices = client.wait_vertices(node, seconds)
            return None if vertices is None else int(np.abs(expected - vertices[0]).sum(axis=1).argmin())

        return measure(values, lambda v: client.set(slider.label, v), wait, DRAG_RATE)


def scrub_splats(model: Predictor, messages: int) -> dict[str, float]:
    """Measures the latency of scrubbing the time of 100,000 splats with covariances, around the largest deformation."""
    splats, values = round_splats(SPLATS, model), largest_deformation_times(model, messages)
    motion = model.solve(splats)
    expected = np.array([motion.deformed(float(v))[0] for v in np.round(values, 4)])

    with served([Column("splats", model, splats)], float(values[0])) as client:

        def wait(seconds: float) -> int | None:
            centres = client.wait_splats("/world/column_0/body/splats", seconds)
            return None if centres is None else int(np.abs(expected - 0.01 * centres[0]).sum(axis=1).argmin())

        return measure(values, lambda v: client.set("time (s)", round(v, 4)), wait, SCRUB_RATE)


def play_free_flight(model: Predictor) -> dict[str, float]:
    """Measures the bytes for each frame of the free flight before the impact, played for two seconds at a tenth of the
    speed."""
    assert model.schema.impact is not None
    with served([Column(model.model, model, model.rest)], 0.02) as client:
        client.set("speed", "1/10")
        client.collect(0.5)
        begin = client.received
        client.press("Play or pause")
        messages = client.collect(2.0)
        frames = sum(m["type"] == "SetPositionMessage" and m["name"].endswith("/body") for m in messages)
        return {"frames": frames, "bytes_per_frame": (client.received - begin) / frames}


def largest_deformation_times(model: Predictor, count: int) -> Floats:
    """Finds (T,) seconds, T = `count`, around the largest deformation of a bundled scene."""
    return (0.288 if model.schema.impact else 0.005) + np.linspace(0.0, 0.025, count)


@contextlib.contextmanager
def served(columns: list[Column], moment: float) -> Iterator[LoopbackClient]:
    """Returns a client of a viewer with these columns, paused at `moment` in s."""
    app = App(columns, port=0)
    try:
        with LoopbackClient(app.server.get_port()) as client:
            client.set("time (s)", moment)
            client.collect(2.0)  # until no more frames of the first seconds arrive
            yield client
    finally:
        app.close()


def measure(
    values: Floats, send: Callable[[float], None], wait: Callable[[float], int | None], rate: float
) -> dict[str, float]:
    """Send `values` (N,) at `rate` Hz, see `latencies`.

    `out_of_order` counts answers to older messages than the answer before; `stale_last` is 1 if the last answer is not
    to the last message.
    """
    latency, order = latencies(values, send, wait, rate)
    return {
        "messages": len(values),
        "answers": len(order),
        "p50_ms": 1e3 * float(np.percentile(latency, 50)),
        "p95_ms": 1e3 * float(np.percentile(latency, 95)),
        "out_of_order": int((np.diff(order) < 0).sum()),
        "stale_last": int(order[-1] != len(values) - 1),
    }


def latencies(
    values: Floats, send: Callable[[float], None], wait: Callable[[float], int | None], rate: float
) -> tuple[Floats, list[int]]:
    """Send `values` (N,) at `rate` Hz; `wait` returns the index of the message that the next answer serves.

    Returns (N,) seconds, each until the first answer to the message or to a newer one, and the indices of the messages
    that were answered, in the order of the answers.
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
    return latency, order
