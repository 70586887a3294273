"""Whether the newest frame is the last one that every browser gets."""

import math
import time
from dataclasses import replace
from typing import Any

import numpy as np

from odeform.simulation.contacts import contact_parameters, push_from
from odeform.types import Mesh, Points
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_figures.viewer_benchmark.resetting import moment_of
from odeform_figures.viewer_benchmark.visitors import Visitors, slider_of
from odeform_viz.app import App
from odeform_viz.pushing import contacts_of, surface_of
from odeform_viz.rendering.checkerboard import checkerboard_parts
from odeform_viz.session import visible_deformation

__all__ = ["seconds_to_newest"]

STEPS = 40
QUIET = 1.0  # s without a frame, after which the last one has come
DEADLINE = 120.0  # s, for a busy machine


def seconds_to_newest(visitors: Visitors, dragging: LoopbackClient) -> float:
    """Seconds from the end of a drag to the vertices of its last message, in the last browser that gets them.

    The page has to be reset. Infinite unless they come to every browser, and come last.
    """
    label = slider_of(visitors.app)
    low, high = (dragging.controls[label].props[name] for name in ("min", "max"))
    values = np.linspace(low, high, STEPS)[np.random.default_rng(1).permutation(STEPS)]
    node = f"/world/column_{visitors.app.columns.all[0].key}/body/part_0"
    expected = _vertices(visitors.app, float(values[-1]))
    for value in values:
        dragging.set(label, float(value))
    begin = changed = time.monotonic()
    newest: dict[LoopbackClient, float] = {}
    while time.monotonic() < begin + DEADLINE:
        for client in visitors.clients:
            for message in client.receive(0.02) or []:
                vertices = message.get("updates", {}).get("vertices") if message.get("name") == node else None
                if vertices is not None:
                    changed = time.monotonic()
                    # frames of other values differ by a hundred times as much; rounding may differ after a new basis
                    agrees = np.allclose(vertices.reshape(-1, 3), expected, rtol=0.0, atol=1e-6)
                    newest[client] = changed - begin if agrees else math.inf
        last = max((newest.get(client, math.inf) for client in visitors.clients), default=math.inf)
        if last < math.inf and time.monotonic() > changed + QUIET:
            return last
    return math.inf


def _vertices(app: App, value: float) -> Points:
    """Returns what a browser is sent for the body at a value of the slider."""
    column = app.columns.all[0]
    assert column.predictor is not None
    assert isinstance(column.geometry, Mesh)
    deformed = visible_deformation(column.predictor.solve(column.geometry, _parameters(app, value)), moment_of(app))
    assert deformed is not None, "expected a time at which the body is deformed"
    return checkerboard_parts(column.geometry)[0].vertices(deformed)


def _parameters(app: App, value: float) -> dict[str, Any]:
    schema, parameters = app.session.schema, app.request().parameters
    if contacts_of(schema) is None:
        return {schema.parameters[0].name: value}
    push = push_from(parameters, surface_of(app.columns.all[0], parameters))
    return {**parameters, **contact_parameters(replace(push, strength=value))}
