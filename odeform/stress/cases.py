"""Extreme inputs: parameters far outside the trained box, every solver at its limits, odd shapes."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from odeform.schema import Schema
from odeform.solver.integrate import SolverSettings
from odeform.solver.registry import METHODS
from odeform.types import Floats, Geometry, Mesh, PointCloud

__all__ = ["Case", "extreme_cases", "inside", "random_quality", "shapes", "subsampled"]

SPREADS = (1.0, 1.5, 3.0, 10.0)
"""Distances from the middle of the trained range, in halves of the range."""
ENORMOUS = (0.0, *(sign * size for size in (1e-300, 1e300, 1.7e308, math.inf) for sign in (1.0, -1.0)), math.nan)
DTYPES = ("float32", "float64")
CONTROLLED = tuple(name for name, method in METHODS.items() if method.controls_step)


@dataclass(frozen=True)
class Case:
    """One solve: the name of a shape, `values` of all parameters in the schema's order, and the solver settings.

    `quality` None stands for the model's own "balanced".
    """

    shape: str
    values: tuple[float, ...]
    quality: SolverSettings | None


def inside(schema: Schema, count: int, seed: int, reach: float = 1.0) -> list[dict[str, float]]:
    """`count` parameter sets, uniformly sampled from `reach` times the trained box."""
    rng = np.random.default_rng(seed)
    return [{p.name: p.denormalise(rng.uniform(-reach, reach)) for p in schema.parameters} for _ in range(count)]


def extreme_cases(schema: Schema, integrates: bool, count: int, seed: int) -> list[Case]:
    """`count` distinct cases, fixed by the seed: corners and extremes (some, if `count` is small), then random ones."""
    rng, window = np.random.default_rng(seed), schema.window.stop
    middle = tuple(p.default for p in schema.parameters)

    def ways(qualities: list[SolverSettings]) -> list[SolverSettings] | list[None]:
        return qualities if integrates else [None]

    out = dict.fromkeys(Case("body", middle, quality) for quality in ways(_limits(window)))
    out |= dict.fromkeys(Case(shape, middle, None) for shape in SHAPES)
    cornered = [tuple(corner.values()) for reach in SPREADS for corner in schema.corners(reach)]
    out |= dict.fromkeys(Case("body", v, quality) for v in cornered for quality in ways(_extremes(window)))
    few = ways([random_quality(rng, window) for _ in range(4)])
    out |= dict.fromkeys(Case("body", v, quality) for v in _enormous(schema, middle) for quality in few)
    while len(out) < count:
        reach = rng.choice(SPREADS)
        values = tuple(p.denormalise(float(rng.uniform(-reach, reach))) for p in schema.parameters)
        out[Case("body", values, ways([random_quality(rng, window)])[0])] = None
    every = max(len(out) / count, 1.0)
    return [case for index, case in enumerate(out) if index % every < 1.0]


def _enormous(schema: Schema, middle: tuple[float, ...]) -> Iterator[tuple[float, ...]]:
    for at in range(len(schema.parameters)):
        for size in ENORMOUS:
            yield (*middle[:at], size, *middle[at + 1 :])


def _extremes(window: float) -> list[SolverSettings]:
    """Every method at coarser and finer steps and tolerances than anyone would choose."""
    fixed = [
        SolverSettings(m, step=window / n, dtype=d) for d, m, n in itertools.product(DTYPES, METHODS, (4.0, 1000.0))
    ]
    return fixed + [
        SolverSettings(m, tolerance=t, dtype=d) for d, m, t in itertools.product(DTYPES, CONTROLLED, (1.0, 1e-9))
    ]


def _limits(window: float) -> list[SolverSettings]:
    """Settings at which solvers take a single step, fail, or reach their step limit."""
    fixed = [
        SolverSettings(m, step=window * n, dtype=d)
        for d, m, n in itertools.product(DTYPES, METHODS, (1e-4, 1e-6, 10.0))
    ]
    return fixed + [
        SolverSettings(m, tolerance=t, dtype=d) for d, m, t in itertools.product(DTYPES, CONTROLLED, (1e-15, 1e9))
    ]


def random_quality(rng: np.random.Generator, window: float) -> SolverSettings:
    """Random solver settings for a window of `window` seconds."""
    dtype = str(rng.choice(DTYPES))
    if rng.random() < 0.5:
        return SolverSettings(
            str(rng.choice(list(METHODS))), step=window / 4.0 ** float(rng.uniform(1.0, 4.0)), dtype=dtype
        )
    return SolverSettings(str(rng.choice(CONTROLLED)), tolerance=10.0 ** float(rng.uniform(-7.0, -0.5)), dtype=dtype)


SHAPES = ("one point", "duplicate points", "1e-6 m", "1e6 m", "1e6 m away", "a million points")


def subsampled(rest: Mesh) -> PointCloud:
    """About 400 points of a body, which represent the motion of all."""
    points = np.asarray(rest.points, dtype=np.float32)
    return PointCloud(points[:: max(len(points) // 400, 1)])


def shapes(rest: Mesh) -> dict[str, Geometry]:
    """Some of the body's own points as "body", and odd shapes by name."""
    points, few = np.asarray(rest.points, dtype=np.float32), subsampled(rest).points
    rng = np.random.default_rng(0)
    centre = points.mean(axis=0)
    return {
        "body": subsampled(rest),
        "one point": PointCloud(few[:1]),
        "duplicate points": Mesh(np.concatenate([rest.points, rest.points]), np.zeros((4, 3), dtype=int)),
        "1e-6 m": PointCloud(_sized(few, centre, 1e-6)),
        "1e6 m": PointCloud(_sized(few, centre, 1e6)),
        "1e6 m away": PointCloud(few + np.float32(1e6)),
        "a million points": PointCloud(points[rng.integers(len(points), size=1_000_000)]),
    }


def _sized(points: Floats, centre: Floats, size: float) -> Floats:
    return (centre + (points - centre) * np.float32(size / np.ptp(points, axis=0).max())).astype(np.float32)
