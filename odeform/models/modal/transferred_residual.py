"""The residual of a trained body, transferred to a body of similar shape."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.geometry.contact import nearest_on
from odeform.geometry.shape_similarity import compare_shapes
from odeform.models.contact.inputs import ContactInputs
from odeform.models.modal.contact_residual import PushRegression
from odeform.models.modal.elastic_body import ElasticBody
from odeform.models.modal.model import ModalModel
from odeform.models.residual import Residual, weight_of
from odeform.motion.reduced_space import POSE
from odeform.types import Basis, Floats, Mesh, Vector

__all__ = ["shape_distance", "standing_offset", "transfer_weight", "transferred_residual"]

MOST, FADES = 0.85, 0.1
"""The weight of a residual on the same shape, and the distance at which it has fallen to a third. The weights that fit
other instances and scans best are 0.5 to 1.1 up to a distance of 0.05, 0.3 at 0.12 and none at 0.17."""


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


def transfer_weight(distance: float) -> float:
    """The weight of a residual that is transferred to a shape at this distance."""
    return MOST * float(np.exp(-((distance / FADES) ** 2)))


@dataclass(frozen=True, eq=False)
class _Transferred:
    """The regression of a trained body at the nearest point of its surface, in the coordinates of another body."""

    part: ModalModel
    known: Residual
    weight: float
    offset: Vector
    """(3,) m: from the mass centre of the other body to the trained one's scene."""
    coefficients: Float[np.ndarray, "known coefficients"]

    def frames(self, inputs: ContactInputs) -> Floats:
        """(B, T, 6 + K) of B pushes."""
        near = [nearest_on(self.part.rest, contact + self.offset) for contact in inputs.contact]
        points, normals = (np.stack([getattr(each, name) for each in near]) for name in ("point", "normal"))
        there = ContactInputs(points - self.part.body.anchor, normals, inputs.force)
        found = self.weight * self.known.regression.frames(there)
        return np.concatenate([found[..., :POSE], found[..., POSE:] @ self.coefficients], axis=-1)


def transferred_residual(part: ModalModel, body: ElasticBody, basis: Basis, weight: float) -> Residual:
    """A part `weight` of the residual of `part`, which has one, for another body with its `basis` (S, 3, K)."""
    known, shape = part.residual, Mesh(body.points.astype(np.float32), body.faces)
    assert known is not None
    regression = known.regression
    assert isinstance(regression, PushRegression)
    # a scale belongs to a stiffness, and modes of the same number need not be as stiff in both bodies
    softest = part.body.eigenvalues[0]  # a body of slender parts has modes of no stiffness, but for rounding
    scale = np.interp(np.log(np.maximum(body.eigenvalues, softest)), np.log(part.body.eigenvalues), regression.scale)
    kept = 1.0 - weight * (1.0 - weight_of(regression.parts, scale))
    standing = standing_offset(shape, part.rest)
    there = Mesh(shape.points + standing.astype(np.float32), shape.faces)
    values = part.evaluate_basis(there, 0.0).values.reshape(-1, len(body.points), 3)
    coefficients = np.einsum("kni,nij,n->kj", values, basis, body.weights)
    return Residual(known.times, kept, _Transferred(part, known, weight, standing + body.anchor, coefficients))
