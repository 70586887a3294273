"""How long a drag takes from the slider's message to the mesh's: `python -m odeform_viz.bench`."""

import argparse
import sys
import time

import numpy as np

import odeform
from odeform.evaluation.bench import ball
from odeform_viz.app import App
from odeform_viz.loopback import LoopbackClient
from odeform_viz.scene import checker_parts
from odeform_viz.session import Column

__all__ = ["drag"]

BODY = "/world/column_0/body/part_0"


def drag(checkpoint: str, port: int, messages: int, points: int = 5000, rate: float = 20.0) -> dict[str, float]:
    """Drag a physical slider at `rate` Hz against a running viewer on this machine.

    Every message asks for a value of its own, so that each answer tells which wish it serves: `out_of_order` counts
    answers to older wishes than the one before, `stale_last` whether the last answer was not to the last wish.
    """
    predictor = odeform.load(checkpoint)
    shape = ball(points, predictor)
    name = predictor.schema.parameters[0].name
    label = f"{name} ({predictor.schema.parameters[0].unit})"
    low, high = predictor.schema.parameters[0].low, predictor.schema.parameters[0].high
    values = np.linspace(low, high, messages)
    moment = 0.02
    app = App([Column(predictor.model, predictor, shape)], port=port)
    latencies, order = [], []
    try:
        with LoopbackClient(port) as client:
            client.set("time (s)", moment)  # pauses
            client.collect(0.5)
            first = checker_parts(shape)[0][0][0]
            expected = np.stack([predictor.solve(shape, {name: v}).deformed(moment)[first] for v in values])
            for index, value in enumerate(values):
                begin = time.perf_counter()
                client.set(label, float(value))
                while (left := begin + 1.0 / rate - time.perf_counter()) > 0.0:
                    vertices = client.wait_vertices(BODY, left)
                    if vertices is not None:
                        served = int(np.abs(expected - vertices[0]).sum(axis=1).argmin())
                        order.append(served)
                        if served == index:
                            latencies.append(1e3 * (time.perf_counter() - begin))
            late = client.wait_vertices(BODY, 1.0)
            if late is not None:
                order.append(int(np.abs(expected - late[0]).sum(axis=1).argmin()))
    finally:
        app.close()
    return {
        "messages": messages,
        "served_in_time": len(latencies),
        "p50_ms": float(np.percentile(latencies, 50)),
        "p95_ms": float(np.percentile(latencies, 95)),
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
