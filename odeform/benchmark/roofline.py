"""Roofline: the peak arithmetic and memory rates of this machine, and the fraction of them that decoding reaches."""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from odeform.benchmark.probes import round_cloud
from odeform.benchmark.timing import milliseconds, typical
from odeform.models.reduced_model import ReducedModel
from odeform.motion.evaluated_basis import evaluate_basis
from odeform.motion.reduced_motion import as_reduced

__all__ = ["least_ms", "roofline", "scaling"]

SIDE = 2048  # rows and columns of the multiplied matrices
BYTES = 256 << 20  # copied at a time
THREADS = os.cpu_count() or 1
POINTS = 100_000
FRAMES = 20


def gemm_gflops() -> float:
    """Returns the best of five products of square matrices in single precision, in GFLOP/s."""
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, SIDE, SIDE)).astype(np.float32)
    out = np.empty_like(a)
    best = milliseconds(lambda _: np.matmul(a, b, out=out), 5, warm=1).min()
    return 2.0 * SIDE**3 / best / 1e6


def memory_gb_s() -> float:
    """Best of five copies on all threads, in GB/s, counting read and written bytes."""
    source, target = np.ones((2, BYTES // 4), dtype=np.float32)
    parts = [slice(i * len(source) // THREADS, (i + 1) * len(source) // THREADS) for i in range(THREADS)]
    with ThreadPoolExecutor(THREADS) as pool:
        best = milliseconds(
            lambda _: list(pool.map(lambda part: np.copyto(target[part], source[part]), parts)), 5, warm=1
        ).min()
    return 2.0 * BYTES / best / 1e6


def least_ms(points: int, modes: int, frames: int, gflops: float, gb_s: float) -> float:
    """Lower bound on the ms of decoding, by arithmetic or by memory, whichever is larger.

    A frame reads the modes, the rest points and the points that they are added to, and writes the result; frames that
    are decoded together read the inputs once.
    """
    read = 4.0 * points * (3 * modes + 4 + 3)
    written = 4.0 * points * 3 * frames
    operations = 2.0 * points * frames * (3 * modes + 9 + 12)
    return max((read + written) / gb_s, operations / gflops) / 1e6


def roofline(predictor: ReducedModel) -> dict[str, Any]:
    """Measures the rates of this machine, and the fraction of them that decoding reaches, for one frame or `FRAMES` at
    once.

    Decoding is timed from reduced coordinates to points: a motion caches the coordinates of the last times.
    """
    gflops, gb_s = gemm_gflops(), memory_gb_s()
    motion = as_reduced(predictor.solve(round_cloud(POINTS, predictor)))
    window = predictor.schema.window
    times = np.linspace(window.start, window.stop, FRAMES)
    modes = len(motion.evaluated.values)
    one = typical(lambda _: motion.vertices(float(times[FRAMES // 2])), 40)
    many = typical(lambda _: motion.vertices(times), 10)
    return {
        "gemm_gflops": gflops,
        "memory_gb_s": gb_s,
        "modes": modes,
        "decode_ms": one,
        "decode_share_of_limit": least_ms(POINTS, modes, 1, gflops, gb_s) / one,
        f"decode_{FRAMES}_frames_ms": many,
        f"decode_{FRAMES}_frames_share_of_limit": least_ms(POINTS, modes, FRAMES, gflops, gb_s) / many,
    }


def scaling(predictor: ReducedModel, sizes: Sequence[int]) -> list[dict[str, Any]]:
    """Measures times in ms over the number of points: solving, evaluating the basis, decoding one frame from its
    coordinates."""
    window = predictor.schema.window
    moment = 0.5 * (window.start + window.stop)
    rows = []
    for points in sizes:
        shape = round_cloud(points, predictor)
        motion = as_reduced(predictor.solve(shape))
        basis = float(milliseconds(lambda _, on=motion: evaluate_basis(on.geometry, on.space, 0.0), 1, warm=0)[0])
        solve = typical(lambda _, shape=shape: predictor.solve(shape), 20)
        decode = typical(lambda _, motion=motion: motion.vertices(moment), 30)
        rows.append({"points": points, "solve_ms": solve, "basis_ms": basis, "decode_ms": decode})
    return rows
