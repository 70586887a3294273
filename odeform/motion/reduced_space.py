"""Reduced coordinates: a motion as a rigid pose and the coefficients of a displacement basis.

In the scene's canonical frame (turned by minus the azimuth about the vertical axis through the anchor), a motion is

    P(t) = anchor + Rz(a) [ R(w(t)) (x + sum_k c_k(t) phi_k(x)) + p(t) ],   x = Rz(-a) (P0 - anchor),

with shift p (3) metres, rotation vector w (3) radians (unwrapped over several turns), and coefficients c (K). All
models of this package predict the vector y = [p, w, c]; y(0) = 0 makes P(0) = P0 exact (paper eq. 4). Of bodies that
roll, they predict amplitudes of patterns in place of c (`odeform.motion.rolling`).
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Float

from odeform.arrays import STEP, in_steps
from odeform.budget import require_memory
from odeform.geometry.rigid import best_rigid, rotation_from_vector, rotation_z, unwrapped_vectors
from odeform.motion.basis import DisplacementBasis, fit_basis
from odeform.motion.rolling import Rolling
from odeform.schema import soft_clip
from odeform.types import Arrays, Basis, Floats, Frames, Mesh, MotionSequence, Perpoint, Rotations, Vector, Vectors

__all__ = [
    "POSE",
    "ReducedSpace",
    "decompose",
    "fit_modes",
    "make_space",
    "motion_rmse",
    "rotation_of",
    "small_motion",
    "to_canonical",
]

POSE = 6  # size of the rigid part of y
SYSTEM_BYTES = 32  # of memory for a pair of centers while the weights of a basis are solved for
MARGIN = 1.15  # times the largest trained shift or deformation, up to which predictions are unchanged


@dataclass(frozen=True, eq=False)
class ReducedSpace:
    """The space of y: the `anchor` (3,) of rotations, in metres, and the basis of deformations.

    The basis is orthonormal under the mass weights of the training mesh, in metres: |c| is the root-mean-square
    displacement of the body, so that errors in c are in metres. The body's radius of gyration, in metres, does the same
    for small rotation errors. `surface`, canonical, is where the training data lie; None where they fill a volume, so
    that their derivatives are known in every direction. `largest` are the largest |p| and |c| of the training data.
    """

    anchor: Vector
    gyration_radius: float
    basis: DisplacementBasis
    surface: Mesh | None
    largest: tuple[float, float] = (float("inf"), float("inf"))
    rolling: Rolling | None = None
    """Patterns of deformation that do not turn with the body, which models predict in place of c; None without."""

    @property
    def coordinates(self) -> int:
        """How many coordinates models predict."""
        return POSE + (self.basis.modes if self.rolling is None else self.rolling.patterns)

    def with_modes(self, y: Float[np.ndarray, "times y"]) -> Float[np.ndarray, "times body_y"]:
        """(T, 6 + K) from what models predict (T, 6 + S)."""
        if self.rolling is None:
            return y
        return np.concatenate([y[:, :POSE], self.rolling.coefficients(y[:, 3:POSE], y[:, POSE:])], axis=1)

    def with_patterns(self, y: Float[np.ndarray, "times body_y"]) -> Float[np.ndarray, "times y"]:
        """(T, 6 + S) from (T, 6 + K): the nearest that patterns can represent."""
        if self.rolling is None:
            return y
        return np.concatenate([y[:, :POSE], self.rolling.amplitudes(y[:, 3:POSE], y[:, POSE:])], axis=1)

    def bounded(self, y: Float[np.ndarray, "times y"], windows: Float[np.ndarray, " times"]) -> Floats:
        """Computes (T, 6 + K), bit-exact up to shifts and deformations 15 % larger than any trained.

        Larger ones, from parameters far outside the trained range or from a coarse solver, are soft-clipped below 30 %,
        so that a body keeps its shape and stays nearby for any input. After `windows` (T,) of the trained window, at
        least 1, a body may have moved that many times as far.
        """
        for part, largest in ((slice(0, 3), self.largest[0] * windows), (slice(POSE, None), self.largest[1])):
            limit = MARGIN * largest
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                size = np.sqrt(np.square(y[:, part]).sum(axis=1))
                if (size > limit).any():
                    y = y.copy()
                    y[:, part] *= np.where(size > limit, soft_clip(size, limit, limit - largest) / size, 1.0)[:, None]
        return y

    def to_json(self) -> dict[str, object]:
        """The values that are no arrays, for the metadata of a checkpoint."""
        return {
            "anchor": [float(x) for x in self.anchor],
            "arm": self.gyration_radius,
            "basis_scale": self.basis.scale,
            "surface": self.surface is not None,
            **({"largest": list(self.largest)} if np.isfinite(self.largest).all() else {}),
        }

    def arrays(self) -> Arrays:
        """The arrays of a checkpoint, by name; `from_parts` reads them."""
        basis, patterns = self.basis, {} if self.rolling is None else self.rolling.arrays()
        if basis.steps is None:
            return {"basis.centers": basis.centers, "basis.weights": basis.weights, **patterns}
        # a fifth of the bytes of the weights, which follow from them
        values = basis.values(basis.centers * basis.scale).transpose(2, 0, 1)
        return {"basis.centers": basis.centers, **in_steps("basis.values", values, basis.steps), **patterns}

    @classmethod
    def from_parts(cls, data: dict[str, object], arrays: Arrays, rest: Mesh) -> "ReducedSpace":
        """From `to_json` and `arrays` of a checkpoint; `rest` is the trained body at rest in the scene."""
        basis = _basis(arrays, float(data["basis_scale"]))  # pyright: ignore
        anchor = np.array(data["anchor"], dtype=float)
        if anchor.shape != (3,):
            raise ValueError(f"anchor: expected three numbers, got {data['anchor']!r}")
        # older checkpoints do not say: all of them are of surfaces
        surface = Mesh(to_canonical(rest.points, anchor, 0.0), rest.faces) if data.get("surface", True) else None
        shift, deformation = data.get("largest", ("inf", "inf"))  # pyright: ignore
        largest = float(shift), float(deformation)  # pyright: ignore
        return cls(anchor, float(data["arm"]), basis, surface, largest, Rolling.from_arrays(arrays, basis.modes))  # pyright: ignore


def _basis(arrays: Arrays, scale: float) -> DisplacementBasis:
    """Reads the basis: its weights, or its values at the centers, which are solved for the weights."""
    centers, steps = arrays["basis.centers"], arrays.get(f"basis.values{STEP}")
    if steps is None:
        weights = arrays["basis.weights"]
        return DisplacementBasis(centers, weights.shape[1] // 3, scale, partial(np.asarray, weights))
    require_memory("basis", f"{len(centers):,} centers", SYSTEM_BYTES * len(centers) ** 2)
    values = arrays["basis.values"]
    if values.shape != (len(steps), *centers.shape) or not np.isfinite(values).all():
        raise ValueError(f"basis.values: expected finite values of {len(steps)} modes at {len(centers)} centers")
    values = values.transpose(1, 2, 0)
    return replace(fit_basis(centers * scale, values, scale), steps=steps)


def to_canonical(points: Vectors, anchor: Vector, azimuth: float) -> Vectors:
    """Maps (..., 3) metres in the scene to metres relative to the anchor, rotated by minus the azimuth in radians."""
    return (np.asarray(points, dtype=float) - anchor) @ rotation_z(azimuth)


def decompose(sequence: MotionSequence, anchor: Vector, azimuth: float) -> tuple[Float[np.ndarray, "times 6"], Frames]:
    """Best-fit rigid motion and remaining deformation, in the canonical frame.

    Returns `pose` (T, 6): shift of the anchor and rotation vector; `local` (T, N, 3): displacements in the body's
    frame, metres, both zero in frame 0.
    """
    moved = to_canonical(sequence.vertices, anchor, azimuth)
    rest = moved[0]
    rotation, shift = best_rigid(rest, moved, sequence.weights)
    centre = sequence.weights @ rest
    shift = shift + centre - rotation @ centre  # the rotation turns about the anchor, not the centroid
    local = np.einsum("tji,tnj->tni", rotation, moved - shift[:, None]) - rest
    pose = np.concatenate([shift, unwrapped_vectors(rotation)], axis=1)
    return pose, local


def fit_modes(locals_: list[Float[np.ndarray, "_ points 3"]], weights: Perpoint, modes: int) -> Basis:
    """Fits the POD of the training deformations (T, N, 3) over one topology: (N, 3, K), orthonormal under the
    weights."""
    root = np.sqrt(weights)[:, None]
    if sum(map(len, locals_)) < 3 * len(weights):  # of many points in few frames, the frames tell the modes
        snapshots = np.concatenate([(local * root).reshape(len(local), -1) for local in locals_])
        vectors = np.linalg.svd(snapshots, full_matrices=False)[2]
        return vectors[:modes].T.reshape(len(weights), 3, -1) / root[..., None]
    covariance = np.zeros((3 * len(weights), 3 * len(weights)))
    for local in locals_:
        snapshots = (local * root).reshape(len(local), -1)
        covariance += snapshots.T @ snapshots
    _, vectors = np.linalg.eigh(covariance)
    return vectors[:, ::-1][:, :modes].reshape(len(weights), 3, -1) / root[..., None]


def make_space(rest: Mesh, modes: Basis, weights: Perpoint, anchor: Vector) -> ReducedSpace:
    """The space of the modes (N, 3, K) at the vertices of `rest`, canonical; vertices without a face are interior."""
    gyration_radius = float(np.sqrt((weights[:, None] * rest.points**2).sum()))
    surface = rest if len(np.unique(rest.faces)) == len(rest.points) else None
    return ReducedSpace(
        np.asarray(anchor, dtype=float), gyration_radius, fit_basis(rest.points, modes, gyration_radius), surface
    )


def rotation_of(pose: Float[np.ndarray, "*batch 6"], azimuth: float) -> tuple[Rotations, Vectors]:
    """Pose (..., 6) -> rotation (..., 3, 3) from canonical to scene axes, shift (..., 3) in scene axes."""
    turn = rotation_z(azimuth)
    return turn @ rotation_from_vector(pose[..., 3:]), pose[..., :3] @ turn.T


def small_motion(y: Float[np.ndarray, "*batch y"], gyration_radius: float) -> Float[np.ndarray, "*batch"]:
    """Root mean square displacement in metres, over the body, by a small y (..., 6 + K).

    A small rotation |w| moves a round body with radius of gyration r by sqrt(2/3) r |w|.
    """
    scale = np.ones(y.shape[-1])
    scale[3:POSE] = gyration_radius * np.sqrt(2.0 / 3.0)
    return np.linalg.norm(y * scale, axis=-1)


def motion_rmse(
    one: Float[np.ndarray, "*batch y"], other: Float[np.ndarray, "*batch y"], gyration_radius: float
) -> float:
    """Root mean square difference in metres between motions y (..., 6 + K), over coordinates, points and all axes."""
    return float(np.sqrt((small_motion(one - other, gyration_radius) ** 2).mean() / 3.0))
