"""Maps the states of the mechanics to reduced coordinates, and makes the basis of deformations that goes with them."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from odeform.geometry.rigid import rotation_from_vector, vector_from_rotation
from odeform.mechanics.elasticity import rigid_modes
from odeform.models.modal.elastic_body import ElasticBody
from odeform.motion.reduced_space import POSE, ReducedSpace, make_space
from odeform.types import Basis, Floats, Ints, Mesh, Rotations, Vectors

__all__ = ["Coordinates", "coordinates_of", "space_of"]


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Maps from modal amplitudes (M,) to what they do to the surface: a small rigid motion and coefficients.

    Modes carry no momentum, but the surface alone, without what is inside, moves and turns a little with them. Where a
    point turns on its way, it moves along an arc: to second order, that is a quadratic function of the amplitudes.
    """

    shifts: Float[np.ndarray, "3 modes"]
    """m per root kg m, in axes of the body."""
    modal_rotations: Float[np.ndarray, "3 modes"]
    """rad per root kg m."""
    coefficients: Float[np.ndarray, "basis modes"]
    """Coefficients of the basis of deformations, which is orthonormal under the weights of the surface."""
    arcs: Float[np.ndarray, "pairs y"]
    """(P, 6 + B): the second order of modal warping, by the products of two amplitudes, i <= j < K."""
    pairs: tuple[Ints, Ints]
    """(P,) i and j."""

    def along(self, directions: Float[np.ndarray, "modes directions"]) -> "Coordinates":
        """Returns the same maps from amplitudes of directions of deformation, whose first K are modes themselves."""
        maps = {name: getattr(self, name) @ directions for name in ("shifts", "modal_rotations", "coefficients")}
        return replace(self, **maps)

    def reduced(self, shift: Vectors, rotation: Rotations, modes: Floats) -> Float[np.ndarray, "times y"]:
        """Computes (T, 6 + B): the body's motion as shift, rotation vector and coefficients, in m and radians."""
        one, other = self.pairs
        arcs = (modes[:, one] * modes[:, other]) @ self.arcs
        coefficients = modes @ self.coefficients.T + arcs[:, POSE:]
        return np.concatenate([self._posed(shift, rotation, modes, arcs), coefficients], axis=1)

    def pose(self, shift: Vectors, rotation: Rotations, modes: Floats) -> Float[np.ndarray, "times 6"]:
        """Computes the first (T, 6) of `reduced`, alone."""
        one, other = self.pairs
        return self._posed(shift, rotation, modes, (modes[:, one] * modes[:, other]) @ self.arcs[:, :POSE])

    def _posed(self, shift: Vectors, rotation: Rotations, modes: Floats, arcs: Floats) -> Floats:
        turned = rotation @ rotation_from_vector(modes @ self.modal_rotations.T + arcs[:, 3:POSE])
        moved = shift + np.einsum("tij,tj->ti", rotation, modes @ self.shifts.T + arcs[:, :3])
        return np.concatenate([moved, vector_from_rotation(turned)], axis=1)

    def placed(self, pose: Float[np.ndarray, "times 6"], modes: Floats) -> tuple[Vectors, Rotations]:
        """Shifts (T, 3) m and rotations (T, 3, 3) of the mass centre for which `reduced` gives a pose."""
        one, other = self.pairs
        arcs = (modes[:, one] * modes[:, other]) @ self.arcs[:, :POSE]
        own = rotation_from_vector(modes @ self.modal_rotations.T + arcs[:, 3:])
        rotation = rotation_from_vector(pose[:, 3:]) @ own.swapaxes(1, 2)
        return pose[:, :3] - np.einsum("tij,tj->ti", rotation, modes @ self.shifts.T + arcs[:, :3]), rotation


def coordinates_of(body: ElasticBody) -> tuple[Coordinates, Basis]:
    """The maps, and the basis (S, 3, K) at the surface of the body: its modes, made orthonormal, softest first."""
    rigid = _Rigid(body)
    motion, left = rigid.split(body.modes)
    root = np.sqrt(np.repeat(body.weights, 3))
    basis, factor = np.linalg.qr((left * root).T)
    pairs = np.triu_indices(body.dynamic)
    bend = np.concatenate([_arcs(body, i) for i in range(body.dynamic)])
    motions, rest = rigid.split(bend)
    arcs = np.concatenate([motions, (rest * root) @ basis], axis=1)
    values = (basis / root[:, None]).reshape(len(body.points), 3, -1)
    return Coordinates(motion[:, :3].T, motion[:, 3:].T, factor, arcs, pairs), values


class _Rigid:
    """Splits displacements of a body's surface into a small rigid motion, of the mass centre, and the rest."""

    def __init__(self, body: ElasticBody) -> None:
        self._weights = np.repeat(body.weights, 3)
        self._modes = rigid_modes(body.points, body.weights).reshape(POSE, -1)
        # these turn about the centroid of the surface, shifts are those of the mass centre
        arms = body.points - body.anchor
        design = np.zeros((len(arms), 3, POSE))
        design[:, [0, 1, 2], [0, 1, 2]] = 1.0
        design[:, :, 3:] = np.cross(np.eye(3)[None], arms[:, None]).transpose(0, 2, 1)
        self._motions = np.linalg.lstsq(design.reshape(-1, POSE), self._modes.T, rcond=None)[0].T

    def split(self, displacements: Floats) -> tuple[Float[np.ndarray, "batch 6"], Float[np.ndarray, "batch entries"]]:
        """(B, S, 3) m -> shift (3) m and rotation vector (3) rad, and what is left (B, 3 S)."""
        flat = displacements.reshape(len(displacements), -1)
        amount = (flat * self._weights) @ self._modes.T
        return amount @ self._motions, flat - amount @ self._modes


def _arcs(body: ElasticBody, i: int) -> Float[np.ndarray, "pairs points 3"]:
    """The second-order displacements of mode i with the modes j >= i, by the products of their amplitudes."""
    turns = body.modal_rotations.transpose(2, 0, 1)[i : body.dynamic]
    modes = body.modes[i : body.dynamic]
    arcs = 0.5 * (np.cross(turns[:1], modes) + np.cross(turns, modes[:1]))
    arcs[0] *= 0.5
    return arcs


def space_of(body: ElasticBody, basis: Basis, largest: tuple[float, float]) -> ReducedSpace:
    """Returns the reduced space of a body, from its basis at the surface and the largest trained shift and deformation
    in m.

    It follows from the body: checkpoints need not hold it.
    """
    space = make_space(Mesh(body.points - body.anchor, body.faces), basis, body.weights, body.anchor)
    return replace(space, largest=largest)
