"""What a prediction costs on this machine: latency by stage, and peers in the same run."""

import itertools
import os
import platform
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import trimesh

from odeform.model.placed import place
from odeform.predictor import Predictor, load
from odeform.schema import Parameters
from odeform.types import Floats, Geometry, Mesh

__all__ = ["ball", "bench", "report"]

FRAMES = 20
PEER_POINTS = 2000


def _milliseconds(work: Callable[[int], object], repeats: int, warm: int = 3) -> Floats:
    for index in range(warm):
        work(index)
    out = np.empty(repeats)
    for index in range(repeats):
        begin = time.perf_counter()
        work(index)
        out[index] = 1e3 * (time.perf_counter() - begin)
    return out


def _quantiles(samples: Floats) -> dict[str, float]:
    return {"p50": float(np.percentile(samples, 50)), "p95": float(np.percentile(samples, 95))}


def ball(points: int, predictor: Predictor) -> Mesh:
    """A round shape of exactly that many points where the predictor expects its body."""
    rest = np.asarray(predictor.rest.points, dtype=float)
    centre, radius = 0.5 * (rest.min(axis=0) + rest.max(axis=0)), 0.5 * np.ptp(rest, axis=0).max()
    index = np.arange(points) + 0.5
    polar, turn = np.arccos(1.0 - 2.0 * index / points), np.pi * (1.0 + 5.0**0.5) * index
    unit = np.stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)], axis=1)
    hull = trimesh.convex.convex_hull(unit)
    return Mesh((centre + radius * unit).astype(np.float32), np.asarray(hull.faces))


def _random_parameters(predictor: Predictor, count: int) -> list[Parameters]:
    rng = np.random.default_rng(0)
    return [{p.name: p.denormalise(rng.uniform(-1.0, 1.0)) for p in predictor.schema.parameters} for _ in range(count)]


def _latency(predictor: Predictor, shape: Geometry) -> dict[str, Any]:
    parameters = _random_parameters(predictor, 60)
    window = predictor.schema.window
    # the heading re-evaluates the basis; it is timed by itself below
    fixed = {p.name: p.default for p in predictor.schema.parameters if p.role == "azimuth"}
    change = _milliseconds(lambda i: predictor.solve(shape, {**parameters[i % 60], **fixed}), 60)
    motion = predictor.solve(shape)
    moments = np.random.default_rng(1).uniform(window.start, window.stop, 300)
    scrub = _milliseconds(lambda i: motion.vertices(float(moments[i % 300])), 300)
    headings = np.random.default_rng(2).uniform(-np.pi, np.pi, 20)
    basis = _milliseconds(lambda i: place(shape, motion.space, float(headings[i % 20])), 20)
    return {
        "parameter_change_ms": _quantiles(change),
        "scrub_ms": _quantiles(scrub),
        "basis_ms": _quantiles(basis),
        "points": len(shape.points),
    }


def _per_point_ms(points: int) -> float:
    """The paper's layout, one latent of 128 numbers a point (encoder 64-128-128, field 6 x 256, decoder 128-64).

    RK4 with a step a frame, torch, untrained weights: only its time is measured.
    """
    import torch
    from torch import nn

    def mlp(sizes: list[int], act: type[nn.Module]) -> nn.Sequential:
        layers: list[nn.Module] = []
        for before, after in itertools.pairwise(sizes):
            layers += [nn.Linear(before, after), act()]
        return nn.Sequential(*layers[:-1])

    encode = mlp([41, 64, 128, 128, 128], nn.ReLU)
    field = mlp([128 + 32 + 1, *([256] * 5), 128], nn.Tanh)
    decode = mlp([128, 128, 64, 3], nn.ReLU)
    with torch.inference_mode():
        inputs, condition = torch.randn(points, 41), torch.randn(points, 33)

        def run(_: int) -> None:
            z, h = encode(inputs), 1.0 / FRAMES
            for _ in range(FRAMES - 1):
                k1 = field(torch.cat([z, condition], dim=1))
                k2 = field(torch.cat([z + h / 2 * k1, condition], dim=1))
                k3 = field(torch.cat([z + h / 2 * k2, condition], dim=1))
                k4 = field(torch.cat([z + h * k3, condition], dim=1))
                z = z + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
                decode(z)

        return float(np.median(_milliseconds(run, 5, warm=1)))


def _peers(predictor: Predictor) -> dict[str, Any]:
    shape = ball(PEER_POINTS, predictor)
    window = predictor.schema.window
    times = np.linspace(window.start, window.stop, FRAMES)
    ours = float(np.median(_milliseconds(lambda _: predictor.solve(shape).vertices(times), 30)))
    theirs = _per_point_ms(PEER_POINTS)
    return {
        "ours": {"points": PEER_POINTS, "frames": FRAMES, "ms": ours, "speedup": 1.0},
        "per-point latent ODE": {
            "points": PEER_POINTS,
            "frames": FRAMES,
            "ms": theirs,
            "speedup": theirs / ours,
            "error_mm": None,
        },
    }


def _qualities(predictor: Predictor, shape: Geometry) -> dict[str, Any]:
    rows = {}
    for name in predictor.qualities:
        samples = _milliseconds(lambda _, name=name: predictor.solve(shape, quality=name), 20)
        stats = predictor.solve(shape, quality=name).stats
        rows[name] = {
            "solver": stats.solver,
            "evaluations": stats.evaluations,
            "ms_p50": float(np.median(samples)),
            "ms_p95": float(np.percentile(samples, 95)),
            "solver_error_mm": stats.solver_error_mm,
        }
    return rows


def bench(checkpoint: str) -> dict[str, Any]:
    """Latency at 5,000 vertices, qualities, and peers at 2,000 points."""
    predictor = load(checkpoint)
    shape = ball(5000, predictor)
    machine = {"processor": platform.processor() or platform.machine(), "cores": os.cpu_count()}
    return {
        "machine": machine,
        "model": predictor.model,
        "latency": _latency(predictor, shape),
        "qualities": _qualities(predictor, shape),
        "peers": _peers(predictor),
    }


def report(result: Mapping[str, Any]) -> str:
    """The figures as a few lines of text."""
    latency = result["latency"]
    lines = [
        f"{result['model']} on {result['machine']['cores']} cores",
        *(
            f"{key:<24} p50 {value['p50']:8.3f} ms   p95 {value['p95']:8.3f} ms"
            for key, value in latency.items()
            if isinstance(value, Mapping)
        ),
        *(
            f"quality {name:<16} {row['solver']}: {row['evaluations']} evaluations, {row['ms_p50']:.2f} ms, "
            f"solver error {row['solver_error_mm']:.2g} mm"
            for name, row in result["qualities"].items()
        ),
        *(
            f"{name}: {row['ms']:.1f} ms for {row['frames']} frames of {row['points']} points, "
            f"ours {row['speedup']:.0f} times faster"
            for name, row in result["peers"].items()
            if name != "ours"
        ),
    ]
    return "\n".join(lines)
