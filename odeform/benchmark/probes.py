"""Inputs of measurements: round shapes with any number of points, parameter sets, and sequences near them."""

from dataclasses import replace
from typing import Any

import numpy as np
import trimesh

from odeform.dataset.index import Dataset
from odeform.geometry.directions import even_directions
from odeform.models.base import Predictor
from odeform.schema import OBJECT, Parameters
from odeform.simulation.scenes.registry import find_scene
from odeform.types import GaussianSplats, Mesh, PointCloud, Points

__all__ = ["nearest_sequences", "random_parameters", "round_cloud", "round_mesh", "round_splats"]


def _round(points: int, predictor: Predictor) -> tuple[Points, Points]:
    """`points` points on a sphere where the body of the predictor rests, in m, and their unit normals; (N, 3) each."""
    rest = np.asarray(predictor.rest.points, dtype=float)
    centre, radius = 0.5 * (rest.min(axis=0) + rest.max(axis=0)), 0.5 * np.ptp(rest, axis=0).max()
    unit = even_directions(points)
    return (centre + radius * unit).astype(np.float32), unit


def round_mesh(points: int, predictor: Predictor) -> Mesh:
    """A round mesh of exactly `points` points, in m, where the body of the predictor rests."""
    where, unit = _round(points, predictor)
    return Mesh(where, np.asarray(trimesh.convex.convex_hull(unit).faces))


def round_cloud(points: int, predictor: Predictor) -> PointCloud:
    """Returns the points of `round_mesh` alone."""
    return PointCloud(_round(points, predictor)[0])


def round_splats(points: int, predictor: Predictor) -> GaussianSplats:
    """Round splats at the points of `round_mesh`, large enough to cover the surface."""
    where, _ = _round(points, predictor)
    area = 4.0 * np.pi * (0.5 * np.ptp(where, axis=0).max()) ** 2 / points
    covariances = np.broadcast_to(area * np.eye(3), (points, 3, 3))
    return GaussianSplats(where, covariances, np.zeros((points, 1, 3)), np.ones(points))


def random_parameters(predictor: Predictor, count: int) -> list[Parameters]:
    """Random parameter sets of the trained box, with one azimuth: the basis depends on it and is timed separately.

    In a scene with objects they are drawn as its data are, all of the default object.
    """
    schema = predictor.schema
    if schema.objects and (scene := find_scene(schema.scene)):
        return list(scene.sample(count, 0, schema.objects[:1]))
    rng = np.random.default_rng(0)
    fixed = {p.name: p.default for p in schema.parameters if p.role == "azimuth"}
    return [{p.name: p.denormalise(rng.uniform(-1.0, 1.0)) for p in schema.learned} | fixed for _ in range(count)]


def nearest_sequences(dataset: Dataset, parameters: Any, count: int) -> Dataset:
    """Returns the `count` test sequences nearest to these parameters, in units of the trained ranges."""
    schema = dataset.schema
    target = schema.vector(parameters)
    same_body = dataset.select("test", parameters.get(OBJECT))
    near = sorted(same_body, key=lambda e: float(((schema.vector(e.parameters) - target) ** 2).sum()))
    return replace(dataset, entries=tuple(near[:count]))
