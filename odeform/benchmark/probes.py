"""What measurements are made on: round shapes of any size, places in the box of parameters, sequences near them."""

from dataclasses import replace
from typing import Any

import numpy as np
import trimesh

from odeform.dataset.index import Dataset
from odeform.models.base import Predictor
from odeform.schema import Parameters
from odeform.types import GaussianSplats, Mesh, PointCloud, Points

__all__ = ["ball", "nearest_sequences", "random_parameters", "round_cloud", "round_splats"]


def _round(points: int, predictor: Predictor) -> tuple[Points, Points]:
    """That many points spread over a sphere where the predictor expects its body, and their unit normals."""
    rest = np.asarray(predictor.rest.points, dtype=float)
    centre, radius = 0.5 * (rest.min(axis=0) + rest.max(axis=0)), 0.5 * np.ptp(rest, axis=0).max()
    index = np.arange(points) + 0.5
    polar, turn = np.arccos(1.0 - 2.0 * index / points), np.pi * (1.0 + 5.0**0.5) * index
    unit = np.stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)], axis=1)
    return (centre + radius * unit).astype(np.float32), unit


def ball(points: int, predictor: Predictor) -> Mesh:
    """A round mesh of exactly that many points where the predictor expects its body."""
    where, unit = _round(points, predictor)
    return Mesh(where, np.asarray(trimesh.convex.convex_hull(unit).faces))


def round_cloud(points: int, predictor: Predictor) -> PointCloud:
    """The points of `ball` alone."""
    return PointCloud(_round(points, predictor)[0])


def round_splats(points: int, predictor: Predictor) -> GaussianSplats:
    """Round splats of a size that covers the ball, at the points of `ball`."""
    where, _ = _round(points, predictor)
    area = 4.0 * np.pi * (0.5 * np.ptp(where, axis=0).max()) ** 2 / points
    covariances = np.broadcast_to(area * np.eye(3), (points, 3, 3))
    return GaussianSplats(where, covariances, np.zeros((points, 1, 3)), np.ones(points))


def random_parameters(predictor: Predictor, count: int, seed: int = 0) -> list[Parameters]:
    """Drawn over the trained box, one heading for all: the basis depends on the heading and is timed by itself."""
    rng = np.random.default_rng(seed)
    fixed = {p.name: p.default for p in predictor.schema.parameters if p.role == "azimuth"}
    learned = predictor.schema.learned
    return [{p.name: p.denormalise(rng.uniform(-1.0, 1.0)) for p in learned} | fixed for _ in range(count)]


def nearest_sequences(dataset: Dataset, parameters: Any, count: int) -> Dataset:
    """The `count` test sequences with parameters nearest to these, each by its trained range."""
    schema = dataset.schema
    wanted = schema.vector(parameters)
    near = sorted(dataset.select("test"), key=lambda e: float(((schema.vector(e.parameters) - wanted) ** 2).sum()))
    return replace(dataset, entries=tuple(near[:count]))
