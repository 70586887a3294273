"""Latency without a client: computing a frame, and packing it into messages."""

import itertools

import numpy as np

from odeform.benchmark.probes import round_splats
from odeform.benchmark.timing import milliseconds
from odeform.models.base import Predictor
from odeform_figures.viewer_benchmark.latency import SPLATS, largest_deformation_times
from odeform_viz.columns import Column, Columns
from odeform_viz.rendering.scene import SceneView
from odeform_viz.runtime.access import Access
from odeform_viz.runtime.server import open_server, stop_server
from odeform_viz.session import Session
from odeform_viz.view import DisplayOptions, ViewRequest

__all__ = ["stages"]


def stages(model: Predictor, messages: int) -> dict[str, float]:
    """Returns the median times of scrubbing 100,000 splats: from the request to arrays, and from these to messages."""
    splats, session = round_splats(SPLATS, model), Session(model.schema)
    columns = Columns.of([Column("splats", model, splats)]).all
    parameters = model.schema.complete({})
    times = largest_deformation_times(model, messages)
    requests = [ViewRequest(parameters, float(t), "balanced", columns) for t in times]
    server = open_server(Access(), 0, "stages")
    try:
        view = SceneView(server, 0.2, lambda: None)
        view.publish(session.frame(requests[0]), DisplayOptions(), None)
        compute = milliseconds(lambda i: session.frame(requests[i]), messages - 3)
        frames = itertools.cycle([session.frame(request) for request in requests[:: max(messages // 10, 1)]])
        pack = milliseconds(lambda _: view.publish(next(frames), DisplayOptions(), None), messages)
    finally:
        stop_server(server)
    return {"compute_p50_ms": float(np.median(compute)), "pack_p50_ms": float(np.median(pack))}
