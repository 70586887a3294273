"""Extreme inputs: parameters far outside the trained box, every solver at its limits, odd shapes."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from odeform.models.base import Predictor
from odeform.schema import Schema
from odeform.simulation.scenes.registry import find_scene
from odeform.solver.integrate import SolverSettings
from odeform.solver.linearly_implicit import LinearlyImplicit
from odeform.solver.registry import METHODS, get_method
from odeform.types import Floats, Geometry, Mesh, PointCloud

__all__ = ["Case", "extreme_cases", "inside", "methods_of", "random_quality", "shapes", "subsampled"]

SPREADS = (1.0, 1.5, 3.0, 10.0)
"""Distances from the middle of the trained range, in halves of the range."""
ENORMOUS = (0.0, *(sign * size for size in (1e-300, 1e300, 1.7e308, math.inf) for sign in (1.0, -1.0)), math.nan)
DRAWS = 56
"""Parameter sets in place of the corners of a box."""
DTYPES = ("float32", "float64")


@dataclass(frozen=True)
class Case:
    """One solve: the name of a shape, `values` of all of `Schema.names`, and the solver settings.

    `quality` None stands for the model's own "balanced".
    """

    shape: str
    values: tuple[Any, ...]
    quality: SolverSettings | None


def methods_of(predictor: Predictor) -> tuple[str, ...]:
    """Names of the methods that can step the field of a model; none if it is not integrated."""
    if not predictor.qualities:
        return ()
    stiff = any(isinstance(get_method(settings.method), LinearlyImplicit) for settings in predictor.qualities.values())
    return tuple(name for name, method in METHODS.items() if stiff or not isinstance(method, LinearlyImplicit))


def inside(schema: Schema, count: int, seed: int, scale: float = 1.0) -> list[dict[str, Any]]:
    """`count` parameter sets, uniformly sampled from `scale` times the trained box.

    In a scene with objects they are drawn as its data are, of all objects, and then stretched by `scale`.
    """
    scene = find_scene(schema.scene) if schema.objects else None
    if scene is None:
        rng = np.random.default_rng(seed)
        return [{p.name: p.denormalise(rng.uniform(-scale, scale)) for p in schema.parameters} for _ in range(count)]
    each = -(-count // len(schema.objects))
    drawn = scene.sample(each, seed, schema.objects)
    mixed = [row for index in range(each) for row in drawn[index::each]][:count]
    return [
        {**row, **{p.name: p.denormalise(scale * p.normalise(row[p.name])) for p in schema.parameters}} for row in mixed
    ]


def _edges(schema: Schema, scale: float) -> list[dict[str, Any]]:
    """The corners of the box; in a scene with objects, which has none, draws of all objects."""
    return inside(schema, DRAWS, 0, scale) if schema.objects else schema.corners(scale)


def extreme_cases(schema: Schema, methods: tuple[str, ...], count: int, seed: int) -> list[Case]:
    """Draws `count` distinct cases, fixed by the seed: corners and extremes (some, if `count` is small), then random
    ones.

    Solvers are those of `methods`; a model that is not integrated has none.
    """
    rng, window = np.random.default_rng(seed), schema.window.stop
    middle = tuple(schema.complete(None).values())

    def ways(qualities: list[SolverSettings]) -> list[SolverSettings] | list[None]:
        return qualities or [None]

    out = dict.fromkeys(Case("body", middle, quality) for quality in ways(_limits(window, methods)))
    out |= dict.fromkeys(Case(shape, middle, None) for shape in SHAPES)
    cornered = [tuple(corner.values()) for scale in SPREADS for corner in _edges(schema, scale)]
    out |= dict.fromkeys(Case("body", v, quality) for v in cornered for quality in ways(_extremes(window, methods)))
    few = ways([random_quality(rng, window, methods) for _ in range(4 if methods else 0)])
    out |= dict.fromkeys(Case("body", v, quality) for v in _enormous(schema, middle) for quality in few)
    while len(out) < count:
        scale = rng.choice(SPREADS)
        body = (str(rng.choice(schema.objects)),) if schema.objects else ()
        values = tuple(p.denormalise(float(rng.uniform(-scale, scale))) for p in schema.parameters)
        out[Case("body", body + values, random_quality(rng, window, methods) if methods else None)] = None
    every = max(len(out) / count, 1.0)
    return [case for index, case in enumerate(out) if index % every < 1.0]


def _enormous(schema: Schema, middle: tuple[Any, ...]) -> Iterator[tuple[Any, ...]]:
    for at in range(len(middle) - len(schema.parameters), len(middle)):
        for size in ENORMOUS:
            yield (*middle[:at], size, *middle[at + 1 :])


def _extremes(window: float, methods: tuple[str, ...]) -> list[SolverSettings]:
    """Every method at coarser and finer steps and tolerances than anyone would choose."""
    fixed = [
        SolverSettings(m, step=window / n, dtype=d) for d, m, n in itertools.product(DTYPES, methods, (4.0, 1000.0))
    ]
    return fixed + [
        SolverSettings(m, tolerance=t, dtype=d)
        for d, m, t in itertools.product(DTYPES, _controlled(methods), (1.0, 1e-9))
    ]


def _limits(window: float, methods: tuple[str, ...]) -> list[SolverSettings]:
    """Settings at which solvers take a single step, fail, or reach their step limit."""
    fixed = [
        SolverSettings(m, step=window * n, dtype=d)
        for d, m, n in itertools.product(DTYPES, methods, (1e-4, 1e-6, 10.0))
    ]
    return fixed + [
        SolverSettings(m, tolerance=t, dtype=d)
        for d, m, t in itertools.product(DTYPES, _controlled(methods), (1e-15, 1e9))
    ]


def _controlled(methods: tuple[str, ...]) -> tuple[str, ...]:
    """Those that a tolerance can control."""
    return tuple(name for name in methods if METHODS[name].controls_step)


def random_quality(rng: np.random.Generator, window: float, methods: tuple[str, ...]) -> SolverSettings:
    """Draws random solver settings of one of the `methods`, for a window of `window` seconds."""
    dtype = str(rng.choice(DTYPES))
    if rng.random() < 0.5:
        return SolverSettings(str(rng.choice(methods)), step=window / 4.0 ** float(rng.uniform(1.0, 4.0)), dtype=dtype)
    return SolverSettings(
        str(rng.choice(_controlled(methods))), tolerance=10.0 ** float(rng.uniform(-7.0, -0.5)), dtype=dtype
    )


SHAPES = ("one point", "duplicate points", "1e-6 m", "1e6 m", "1e6 m away", "a million points")


def subsampled(rest: Mesh) -> PointCloud:
    """Returns about 400 points of a body, which represent the motion of all."""
    points = np.asarray(rest.points, dtype=np.float32)
    return PointCloud(points[:: max(len(points) // 400, 1)])


def shapes(rest: Mesh) -> dict[str, Geometry]:
    """Returns some of the body's own points as "body", and odd shapes by name."""
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
