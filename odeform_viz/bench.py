"""How long a drag takes from the slider's message to the mesh's: `python -m odeform_viz.bench`."""

import argparse
import sys
import time

import numpy as np

import odeform
from odeform.evaluation.bench import ball
from odeform_viz.app import App
from odeform_viz.columns import Column
from odeform_viz.loopback import LoopbackClient
from odeform_viz.shapes import checker_parts

__all__ = ["drag"]

BODY = "/world/column_0/body/part_0"


def drag(checkpoint: str, port: int, messages: int, points: int = 5000, rate: float = 20.0) -> dict[str, float]:
    """Drag a physical slider at `rate` Hz against a running viewer on this machine.

    Every message asks for a value of its own, so that each answer tells which wish it serves. A wish's latency runs
    to the first answer that serves it or a newer one. `out_of_order` counts answers to older wishes than the one
    before, `stale_last` whether the last answer was not to the last wish.
    """
    predictor = odeform.load(checkpoint)
    shape = ball(points, predictor)
    slider = predictor.schema.parameters[0]
    values = np.linspace(slider.low, slider.high, messages)
    moment = 0.02
    app = App([Column(predictor.model, predictor, shape)], port=port)
    sent, latency, order = np.zeros(messages), np.full(messages, np.nan), []
    try:
        with LoopbackClient(port) as client:
            client.set("time (s)", moment)  # pauses
            client.collect(0.5)
            first = checker_parts(shape)[0][0][0]
            expected = np.stack([predictor.solve(shape, {slider.name: v}).deformed(moment)[first] for v in values])

            def listen(until: float) -> None:
                while (left := until - time.perf_counter()) > 0.0:
                    vertices = client.wait_vertices(BODY, left)
                    if vertices is not None:
                        order.append(int(np.abs(expected - vertices[0]).sum(axis=1).argmin()))
                        waiting = np.isnan(latency[: order[-1] + 1])
                        latency[: order[-1] + 1][waiting] = time.perf_counter() - sent[: order[-1] + 1][waiting]

            for index, value in enumerate(values):
                sent[index] = time.perf_counter()
                client.set(f"{slider.name} ({slider.unit})", float(value))
                listen(sent[index] + 1.0 / rate)
            listen(time.perf_counter() + 1.0)
    finally:
        app.close()
    return {
        "messages": messages,
        "answers": len(order),
        "p50_ms": 1e3 * float(np.percentile(latency, 50)),
        "p95_ms": 1e3 * float(np.percentile(latency, 95)),
        "out_of_order": int((np.diff(order) < 0).sum()),
        "stale_last": int(order[-1] != messages - 1),
    }


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m odeform_viz.bench")
    parser.add_argument("--checkpoint", default="kick")
    parser.add_argument("--messages", type=int, default=1000)
    parser.add_argument("--port", type=int, default=8097)
    args = parser.parse_args()
    for key, value in drag(args.checkpoint, args.port, args.messages).items():
        print(f"{key:<16} {value:.6g}")


if __name__ == "__main__":
    sys.exit(main())
