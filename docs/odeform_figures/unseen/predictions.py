"""Predictions for an unseen shape: of the model, of it without deformation, and of the nearest trained object."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from odeform.geometry.contact import CONE, surface_point, touching_centre
from odeform.models.base import Predictor
from odeform.models.modal.user_body import UserBodyPredictor
from odeform.motion.base import Motion
from odeform.schema import OBJECT, Parameters
from odeform.simulation.contacts import CONTACT, FORCE, vector_of
from odeform.types import Floats, Frames, Mesh, MotionSequence, Points, Vector

__all__ = ["Predictions", "nearest_motion", "predictions"]

INWARD = 0.05  # least cosine between a force and the inward normal


@dataclass(frozen=True, eq=False)
class Predictions:
    """Displacements (T, N, 3) in metres of a shape's N vertices under one push, and the true ones."""

    truth: Frames
    model: Frames
    rigid: Frames
    """Predictions of the model with its deformation set to zero."""
    nearest: Frames
    """Predictions of the nearest trained object under the same push."""


def predictions(predictor: UserBodyPredictor, nearest: Predictor, truth: MotionSequence) -> Predictions:
    """All of one push. `nearest` is the trained model whose own object is carried over to the shape."""
    like = predictor.user_body.like
    given = {**truth.parameters, **predictor.parameters_like()}
    motion = predictor.solve(None, given, until=float(truth.times[-1]))
    rest, times = truth.rest.points.astype(float), truth.times
    carried = nearest_motion(nearest, like, truth.rest, truth.parameters, times)
    return Predictions(
        truth.vertices - truth.vertices[0].astype(float),
        np.asarray(motion.vertices(times), dtype=float) - predictor.rest.points,
        _posed(motion, rest, times) - rest,
        carried,
    )


def _posed(motion: Motion, rest: Points, times: Floats) -> Frames:
    poses = motion.pose(times)
    return np.einsum("tij,nj->tni", poses[:, :3, :3], rest) + poses[:, None, :3, 3]


def nearest_motion(predictor: Predictor, name: str, rest: Mesh, parameters: Parameters, times: Floats) -> Frames:
    """(T, N, 3) m: displacements of a shape as the trained object `name` would move under the same force.

    Both rest on the floor and face the same way. The shape is put where the object stands, and the contact is the
    nearest point of the object where the sphere fits and the force pushes inward; without any, nothing moves.
    """
    body = predictor.rest_of({OBJECT: name})
    offset = _middle(body) - _middle(rest)
    points = np.asarray(rest.points, dtype=np.float32) + offset.astype(np.float32)
    force = vector_of(parameters, FORCE)
    contact = _contact_near(body, vector_of(parameters, CONTACT) + offset, force)
    if contact is None:
        return np.zeros((len(times), len(points), 3))
    values = {f"{CONTACT}_{axis}": float(x) for axis, x in zip("xyz", contact, strict=True)}
    given = {**parameters, OBJECT: name, **values}
    motion = predictor.solve(Mesh(points, rest.faces), given, until=float(times[-1]))
    return np.asarray(motion.vertices(times), dtype=float) - points


def _middle(mesh: Mesh) -> Vector:
    """(3,) m: the middle of a body's extent, at the height of the floor."""
    points = np.asarray(mesh.points, dtype=float)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return middle * [1.0, 1.0, 0.0]


def _contact_near(body: Mesh, point: Vector, force: Vector) -> Vector | None:
    """(3,) m: the vertex nearest to a point where the sphere fits and the force lies within its cone, or at least
    pushes inward; None without any."""
    size = float(np.linalg.norm(force))
    corner = np.argmax(body.faces.ravel()[:, None] == np.arange(len(body.points)), axis=0)
    _, near = KDTree(np.asarray(body.points, dtype=float)).query(point, len(body.points))
    for cosine in (np.cos(CONE), INWARD):
        for vertex in np.ravel(near):
            face, place = divmod(int(corner[vertex]), 3)
            touched = surface_point(body, face, np.eye(3)[place])
            if float(-touched.normal @ force) >= size * cosine and touching_centre(body, touched) is not None:
                return touched.point
    return None
