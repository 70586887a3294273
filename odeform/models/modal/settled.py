"""A body where it comes to rest on the floor under another mass or stiffness than those that it was measured at."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from odeform.geometry.rigid import rotation_from_vector, vector_from_rotation
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.mechanics.flat import body_motion
from odeform.mechanics.push import no_push
from odeform.mechanics.pushed_batch import pushed_bodies
from odeform.mechanics.step import Mechanics, Projectile, Rest
from odeform.models.modal.coordinates import Coordinates
from odeform.models.modal.elastic_body import ElasticBody
from odeform.motion.evaluated_basis import STILL, EvaluatedBasis
from odeform.motion.reduced_space import POSE
from odeform.types import Basis, Floats, Geometry, Mesh, Rotations, Vectors

__all__ = ["SettledBody", "rested", "settled_body"]

STEP, LONGEST = 4e-3, 500  # s, and how many of them at most
STILL_SPEED = 1e-4  # m/s, RMS over the body, below which it counts as settled
CALM = 5  # steps that slow


@dataclass(frozen=True, eq=False)
class SettledBody:
    """Motions are those from its own rest: y(0) = 0, and points are as they rest there."""

    mechanics: Mechanics
    rest: Mesh
    """Its surface in the scene."""
    y: Float[np.ndarray, " y"]
    """(6 + K,) how it lies in the coordinates of the body that was measured."""

    def above(self, floor: float) -> "SettledBody":
        """The same, flat where it would be below `floor` m."""
        points = self.rest.points.copy()
        np.maximum(points[:, 2], points.dtype.type(floor), out=points[:, 2])
        return replace(self, rest=Mesh(points, self.rest.faces))

    @property
    def turn(self) -> Rotations:
        """(3, 3) of `y`."""
        return rotation_from_vector(self.y[3:POSE])

    def relative(self, y: Float[np.ndarray, "times y"]) -> Floats:
        """(T, 6 + K) from its own rest, of coordinates (T, 6 + K) of the body that was measured."""
        return np.concatenate([self.relative_pose(y), y[:, POSE:] - self.y[POSE:]], axis=1)

    def relative_pose(self, y: Float[np.ndarray, "times y"]) -> Float[np.ndarray, "times 6"]:
        """Computes the first (T, 6) of `relative`, which depend on the first six alone."""
        turn = rotation_from_vector(y[:, 3:POSE]) @ self.turn.T
        return np.concatenate([y[:, :3] - turn @ self.y[:3], vector_from_rotation(turn)], axis=1)

    def absolute(self, pose: Float[np.ndarray, "times 6"]) -> Floats:
        """Computes (T, 6) the inverse of `relative`, of rigid motions."""
        turn = rotation_from_vector(pose[:, 3:])
        return np.concatenate([pose[:, :3] + turn @ self.y[:3], vector_from_rotation(turn @ self.turn)], axis=1)

    def basis(self, measured: EvaluatedBasis, geometry: Geometry) -> EvaluatedBasis:
        """The basis on `geometry`, which is `rest`, from that on the body that was measured: the same vertices have the
        same modes."""
        points = np.array(geometry.points, dtype=np.float32)
        rows = measured.rows.copy()
        rows[STILL - 1] = (points - measured.space.anchor).astype(np.float32).ravel()
        modes = rows[STILL:].reshape(-1, 3)
        modes[:] = modes @ self.turn.T.astype(np.float32)
        return replace(measured, geometry=geometry, points=points, rest=rows[STILL - 1].reshape(-1, 3), rows=rows)


def settled_body(
    body: ElasticBody,
    contact_parameters: ContactParameters,
    projectile: Projectile,
    ratios: tuple[float, float],
    coordinates: Coordinates,
    basis: Basis,
) -> SettledBody:
    """The body with so many times its mass and its stiffness, `ratios`, once it has come to rest.

    Its own stress, which balanced its weight, grows with the stiffness, and the weight with the mass.
    """
    mass, stiffness = ratios
    mechanics = Mechanics(body.reduced().changed(mass, stiffness), contact_parameters, projectile, stiffness / mass)
    state = rested(mechanics, body.dynamic)
    shift, rotation, modes = body_motion(state)
    mechanics = replace(mechanics, rest=Rest(shift[0], rotation[0], modes[0]))
    lighter = modes / np.sqrt(mass)  # amplitudes of the modes of the body that was measured
    y = coordinates.along(np.eye(len(body.eigenvalues))[:, : body.dynamic]).reduced(shift, rotation, lighter)[0]
    return SettledBody(mechanics, Mesh(_points(body, basis, y), body.faces), y)


def rested(mechanics: Mechanics, soft: int) -> Float[np.ndarray, "1 state"]:
    """The flat state of a body in its `soft` softest modes once it has come to rest, from where it would start.

    It loses its velocity whenever its kinetic energy passes a maximum (kinetic damping).
    """
    push = no_push(mechanics.body, soft)
    bodies = pushed_bodies(mechanics, push, 0.0)
    state, row, step = bodies.start, np.zeros(1, dtype=np.int64), np.full(1, STEP)
    speed, calm = 0.0, 0
    velocity = slice(13 + push.eigenvalues.shape[1], None)
    for _ in range(LONGEST):
        state = bodies.advance(row, step, state, step)[0]
        before, speed = speed, _speed(state[0, velocity], mechanics.body.solid.mass)
        calm = calm + 1 if speed < STILL_SPEED else 0
        if speed < before:
            state[0, velocity], speed = 0.0, 0.0
        if calm > CALM:
            break
    return state


def _speed(velocity: Floats, mass: float) -> float:
    """RMS over the body, about, in m/s."""
    return float(np.sqrt((velocity[:3] ** 2).sum() + (velocity[6:-1] ** 2).sum() / mass))


def _points(body: ElasticBody, basis: Basis, y: Floats) -> Vectors:
    """(S, 3) m: the surface at coordinates (6 + K,)."""
    bent = body.points - body.anchor + basis @ y[POSE:]
    return (body.anchor + bent @ rotation_from_vector(y[3:POSE]).T + y[:3]).astype(np.float32)
