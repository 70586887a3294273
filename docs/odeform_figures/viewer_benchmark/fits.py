"""Fits on the page: how long one takes, and the latency of a slider that is dragged meanwhile."""

import threading
import time

import numpy as np

from odeform.models.base import Predictor
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_figures.viewer_benchmark.latency import DRAG_RATE, measure
from odeform_viz.app import App
from odeform_viz.columns import Column
from odeform_viz.rendering.checkerboard import checkerboard_parts

__all__ = ["drag_while_fitting"]

MOMENT = {True: 0.3, False: 0.02}  # s at which bodies are deformed, by whether they fall first
DONE = "Mean square difference"  # in the text of a fit that is done


def drag_while_fitting(model: Predictor, truth: Column, messages: int) -> dict[str, float]:
    """Drag the first slider while a second browser fits the truth again and again, with both in one place.

    `fit_p50_s` and `fit_max_s` are from the click to the estimates, and `fits` is their number.
    """
    slider, parts = model.schema.parameters[0], checkerboard_parts(model.rest)
    node = f"/world/column_0/body/part_{len(parts) - 1}"
    values, moment = np.linspace(slider.low, slider.high, messages), MOMENT[model.schema.impact is not None]
    others = truth.truth.parameters if truth.truth is not None else {}
    motions = (model.solve(parameters={**others, slider.name: v}) for v in values)
    expected = np.stack([parts[-1].vertices(motion.deformed(moment))[0] for motion in motions])
    app, over, seconds = App([Column(model.model, model, model.rest), truth], port=0), threading.Event(), []

    def fit() -> None:
        with LoopbackClient(app.server.get_port()) as client:
            while not over.is_set():
                begin = time.perf_counter()
                client.click("Fit to the truth")
                client.until(lambda: DONE not in client.text())
                if client.until(lambda: DONE in client.text()):
                    seconds.append(time.perf_counter() - begin)

    fitting = threading.Thread(target=fit, daemon=True)
    try:
        with LoopbackClient(app.server.get_port()) as client:
            client.set("time (s)", moment)
            client.collect(2.0)

            def wait(timeout: float) -> int | None:
                vertices = client.wait_vertices(node, timeout)
                return None if vertices is None else int(np.abs(expected - vertices[0]).sum(axis=1).argmin())

            fitting.start()
            found = measure(values, lambda v: client.set(slider.label, v), wait, DRAG_RATE)
        over.set()
        fitting.join()
    finally:
        app.close()
    fits = {"fits": len(seconds), "fit_p50_s": float(np.median(seconds)), "fit_max_s": max(seconds)}
    return {**found, **fits}
