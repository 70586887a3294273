"""Latency of a click: from the message of a click on a body to the message of its new motion."""

import time

import numpy as np

from odeform.errors import InputError
from odeform.geometry.contact import nearest_on, touching_centre
from odeform.geometry.normals import vertex_normals
from odeform.models.base import Predictor
from odeform.types import Floats, Mesh, Points
from odeform_figures.viewer_benchmark.latency import served
from odeform_viz.columns import Column
from odeform_viz.rendering.checkerboard import checkerboard_parts

__all__ = ["click"]

MOMENT = 0.02  # s; the sphere pushes then, and bodies have hardly moved
PAUSE = 0.3  # s between an answer and the next click
DEADLINE = 5.0  # s
DISTANCE = 0.3  # m, from which a click comes, along the normal


def click(model: Predictor, messages: int) -> dict[str, float]:
    """Measures the latency of clicks on different points of the default object of a model, one after the other."""
    rest = model.rest_of(model.complete({}))
    targets, directions = _targets(rest, messages)
    node = f"/world/column_0/body/part_{len(checkerboard_parts(rest)) - 1}"
    latencies = []
    with served([Column(model.model, model, rest)], MOMENT) as client:
        for target, direction in zip(targets, directions, strict=True):
            client.collect(PAUSE)
            sent = time.perf_counter()
            client.click_scene(target - DISTANCE * direction, direction)
            if client.wait_vertices(node, DEADLINE) is not None:
                latencies.append(time.perf_counter() - sent)
    if not latencies:
        raise InputError(f"no click was answered within {DEADLINE:g} s")
    p50, p95 = (1e3 * float(np.percentile(latencies, percent)) for percent in (50, 95))
    return {"messages": len(targets), "answers": len(latencies), "p50_ms": p50, "p95_ms": p95}


def _targets(rest: Mesh, count: int) -> tuple[Points, Points]:
    """Points (N, 3) m of the surface where the sphere fits, in random order, and the inward normals there."""
    normals = vertex_normals(np.asarray(rest.points, dtype=float), rest.faces)
    order = np.random.default_rng(0).permutation(len(rest.points))
    chosen: list[int] = []
    for index in order:
        if touching_centre(rest, nearest_on(rest, _position(rest, index))) is not None:
            chosen.append(int(index))
        if len(chosen) == count:
            break
    if not chosen:
        raise InputError("the sphere fits nowhere on the surface")
    return np.asarray(rest.points[chosen], dtype=float), -normals[chosen]


def _position(rest: Mesh, index: int) -> Floats:
    return np.asarray(rest.points[index], dtype=float)
