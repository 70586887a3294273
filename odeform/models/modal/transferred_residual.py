"""The correction of a trained body, carried over to a body of similar shape."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from odeform.geometry.contact import nearest_on
from odeform.geometry.likeness import compare_shapes
from odeform.models.contact.inputs import ContactInputs
from odeform.models.modal.coordinates import coordinates_of
from odeform.models.modal.correction import kept_of
from odeform.models.modal.elastic_body import ElasticBody
from odeform.models.modal.model import ModalModel
from odeform.motion.reduced_space import POSE
from odeform.types import Floats, Mesh, Vector

__all__ = ["CarriedCorrection", "shape_distance", "share_at", "standing_offset"]

SHARE, FADES = 0.85, 0.1
"""The share of a correction that the same shape gets, and the distance at which it has fallen to a third. The shares
that fit other instances and scans best are 0.5 to 1.1 up to a distance of 0.05, 0.3 at 0.12 and none at 0.17."""


def standing_offset(shape: Mesh, body: Mesh) -> Vector:
    """(3,) m: from where a shape stands on the floor to where a body does, by the middles of their extents."""
    middles = (0.5 * (mesh.points.min(axis=0) + mesh.points.max(axis=0)) for mesh in (shape, body))
    here, there = (np.asarray(middle, dtype=float) for middle in middles)
    return (there - here) * [1.0, 1.0, 0.0]


def shape_distance(shape: Mesh, body: Mesh) -> float:
    """How far a shape is from a body: the mean distance of their surfaces, relative to the body's size.

    Both rest on the floor and face the same way; they are compared in one place.
    """
    offset = standing_offset(shape, body).astype(np.float32)
    moved = Mesh(shape.points + offset, shape.faces)
    return compare_shapes(moved, [body]).mean / float(np.ptp(body.points, axis=0).max())


def share_at(distance: float) -> float:
    """The share of a correction that is carried over to a shape at this distance."""
    return SHARE * float(np.exp(-((distance / FADES) ** 2)))


class CarriedCorrection:
    """Part of what the trained body's mechanics leaves unexplained, at the nearest point of its surface."""

    def __init__(self, part: ModalModel, body: ElasticBody, share: float) -> None:
        """`share` is the part of the correction of `part`, which has one, that is carried over to `body`.

        `kept` (6 + K,) and `stop` are as those of `Correction`.
        """
        shape = Mesh(body.points.astype(np.float32), body.faces)
        assert part.correction is not None
        self._part, self._correction, self._share = part, part.correction, share
        # a gain belongs to a stiffness, and modes of the same number need not be as stiff in both bodies
        gains = np.interp(np.log(body.squares), np.log(part.body.squares), part.correction.gains)
        self.kept = 1.0 - share * (1.0 - kept_of(part.correction.shares, gains))
        self.stop = part.correction.stop
        self._offset = standing_offset(shape, part.rest) + body.anchor
        there = Mesh(shape.points + standing_offset(shape, part.rest).astype(np.float32), shape.faces)
        values = part.evaluate_basis(there, 0.0).values.reshape(-1, len(body.points), 3)
        _, basis = coordinates_of(body)
        self._coefficients = np.einsum("kni,nij,n->kj", values, basis, body.weights)

    def over_times(self, pushes: ContactInputs) -> Callable[[Floats], Float[np.ndarray, "batch times y"]]:
        """(T,) s -> (B, T, 6 + K), of B pushes."""
        each = [
            self.over_time(ContactInputs(*(part[None] for part in one)))
            for one in zip(pushes.contact, pushes.normal, pushes.force, strict=True)
        ]
        return lambda times: np.stack([known(times) for known in each])

    def over_time(self, push: ContactInputs) -> Callable[[Floats], Float[np.ndarray, "times y"]]:
        """(T,) s -> (T, 6 + K), as that of `Correction`, in the coordinates of the other body."""
        near = nearest_on(self._part.rest, push.contact[0] + self._offset)
        anchor = self._part.body.anchor
        known = self._correction.over_time(ContactInputs(near.point[None] - anchor, near.normal[None], push.force))

        def carried(times: Floats) -> Floats:
            found = self._share * known(times)
            return np.concatenate([found[:, :POSE], found[:, POSE:] @ self._coefficients], axis=1)

        return carried
