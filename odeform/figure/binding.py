"""Binds many points to a few of them: how these move says how all do.

A displacement field is a sum of modes. Each point follows its nearest nodes with the weights that reproduce the modes
there best, each counted by how much the motion has of it; and axes at a node follow the nodes around it likewise.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int16, UInt16
from scipy.spatial import KDTree

from odeform.figure.table import quantised
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.local_frames import evaluate_local_frames
from odeform.types import Arrays, Floats, Ints, Perpoint, Points

__all__ = ["Binding", "bound"]

NODES = 800
CARRIERS, AROUND = 4, 8  # nodes that carry a point, and the axes at a node
BLOCK = 4096  # points at a time
SHARE = 0.02  # of the largest mode, that each counts by at least
STIFF = 1e-3  # of the modes' size, by which weights have to reproduce constant and linear fields as well
RIDGE = 1e-7  # relative, against weights that cancel


@dataclass(frozen=True, eq=False)
class Binding:
    """N points, bound to n nodes among them."""

    nodes: Ints
    """(n,) which of the points."""
    near: UInt16[np.ndarray, "points carriers"]
    """Nodes that carry a point, the nearest first."""
    weights: Int16[np.ndarray, "points carriers"]
    """Of their displacements, in `weight_step`."""
    weight_step: float
    around: UInt16[np.ndarray, "nodes around"]
    """Nodes that carry the axes at a node."""
    slopes: Int16[np.ndarray, "nodes followed around"]
    """Of their displacements in how an axis changes, per metre, in `slope_step`."""
    slope_step: float
    axes: Float[np.ndarray, "3 3 nodes"]
    """(3, 3, n): those at rest, canonical; of those that `slopes` leaves out, the last stays their normal."""

    def of(self, kept: Ints) -> "Binding":
        """Returns that of the points `kept` (S,); nodes stay."""
        return replace(self, near=self.near[kept], weights=self.weights[kept])

    def carried(self, moved: Float[np.ndarray, "times nodes 3"]) -> Floats:
        """Computes displacements (T, N, 3) m of the points from those of the nodes."""
        out = np.zeros((len(moved), len(self.near), 3), dtype=np.float32)
        weights = (self.weights * self.weight_step).astype(np.float32)
        for carrier in range(self.near.shape[1]):
            out += weights[:, carrier, None] * moved[:, self.near[:, carrier]]
        return out

    def arrays(self) -> Arrays:
        """What the page holds of it, by name."""
        return {
            "near": self.near,
            "near_weights": self.weights,
            "around": self.around,
            "around_weights": self.slopes,
            "around_axes": np.ascontiguousarray(self.axes.transpose(2, 0, 1), dtype=np.float32),
            "bound_steps": np.array([self.weight_step, self.slope_step], dtype=np.float32),
        }


def bound(evaluated: EvaluatedBasis, sizes: Float[np.ndarray, " modes"]) -> Binding:
    """Binds the points of a geometry; `sizes` (K,) m are RMS coefficients of the modes over the motion."""
    rest, modes = evaluated.rest.astype(float), len(evaluated.values)
    nodes = _spread(rest, min(NODES, len(rest)))
    counted = np.maximum(sizes, SHARE * sizes.max(initial=0.0)) if sizes.any() else np.ones(modes)
    values = (evaluated.values.reshape(modes, -1, 3) * counted[:, None, None]).transpose(1, 0, 2)
    near = KDTree(rest[nodes]).query(rest, min(CARRIERS, len(nodes)))[1].reshape(len(rest), -1)
    around = KDTree(rest[nodes]).query(rest[nodes], min(AROUND, len(nodes)))[1].reshape(len(nodes), -1)
    frames = evaluate_local_frames(evaluated.rest[nodes], evaluated.space)
    steep = (frames.slopes * counted[:, None, None, None]).transpose(3, 1, 0, 2)  # (n, M, K, 3)
    followed = steep.shape[1]
    scale = float(np.ptp(rest, axis=0).max()) or 1.0
    weights = np.concatenate(
        [_weights(rest[nodes], values[nodes], near[rows], rest[rows], values[rows], scale) for rows in _blocks(rest)]
    )
    slopes = np.stack(
        [
            _slopes(rest[nodes], values[nodes], around, steep[:, axis], frames.rest[axis].T, scale)
            for axis in range(followed)
        ],
        axis=1,
    )
    whole, weight_step = quantised(weights.reshape(1, -1))
    steeper, slope_step = quantised(slopes.reshape(1, -1))
    return Binding(
        nodes,
        near.astype(np.uint16),
        whole.reshape(weights.shape),
        float(weight_step[0]),
        around.astype(np.uint16),
        steeper.reshape(slopes.shape),
        float(slope_step[0]),
        frames.rest,
    )


def _spread(points: Points, count: int) -> Ints:
    """(n,) points far from one another, each next one the farthest from those before."""
    chosen = np.zeros(count, dtype=np.int64)
    away = np.square(points - points[0]).sum(axis=1)
    for index in range(1, count):
        chosen[index] = away.argmax()
        np.minimum(away, np.square(points - points[chosen[index]]).sum(axis=1), out=away)
    return chosen


def _blocks(points: Points) -> Iterator[slice]:
    return (slice(at, at + BLOCK) for at in range(0, len(points), BLOCK))


def _weights(
    nodes: Float[np.ndarray, "nodes 3"],
    of_nodes: Float[np.ndarray, "nodes modes 3"],
    near: Ints,
    points: Points,
    values: Float[np.ndarray, "points modes 3"],
    scale: float,
) -> Floats:
    """(P, J) that reproduce `values`, and to some degree the constants and the coordinates."""
    linear = np.concatenate([np.ones((*near.shape, 1)), (nodes[near] - points[:, None]) / scale], axis=2)
    target = np.tile([1.0, 0.0, 0.0, 0.0], (len(points), 1))
    return _solved(of_nodes[near], values, linear, target)


def _slopes(
    nodes: Float[np.ndarray, "nodes 3"],
    of_nodes: Float[np.ndarray, "nodes modes 3"],
    around: Ints,
    steep: Float[np.ndarray, "nodes modes 3"],
    axis: Float[np.ndarray, "nodes 3"],
    scale: float,
) -> Floats:
    """(n, J) per metre, that reproduce derivatives along the unit vectors `axis` (n, 3)."""
    linear = np.concatenate([np.ones((*around.shape, 1)), (nodes[around] - nodes[:, None]) / scale], axis=2)
    target = np.concatenate([np.zeros((len(nodes), 1)), axis], axis=1)
    return _solved(of_nodes[around], scale * steep, linear, target) / scale


def _solved(
    columns: Float[np.ndarray, "points carriers modes 3"],
    values: Float[np.ndarray, "points modes 3"],
    linear: Float[np.ndarray, "points carriers 4"],
    target: Float[np.ndarray, "points 4"],
) -> Floats:
    """Least squares: (P, J) weights of `columns` that sum up to `values`, and of `linear` to `target`."""
    count, carriers = columns.shape[:2]
    stiff: Perpoint = STIFF * np.sqrt(np.square(columns, dtype=float).sum(axis=(1, 2, 3)) / carriers)
    rows = np.concatenate([columns.reshape(count, carriers, -1), stiff[:, None, None] * linear], axis=2)
    goal = np.concatenate([values.reshape(count, -1), stiff[:, None] * target], axis=1)
    gram = rows @ rows.swapaxes(1, 2)
    size = np.trace(gram, axis1=1, axis2=2) + np.finfo(float).tiny
    gram += (RIDGE * size)[:, None, None] * np.eye(carriers)
    return np.linalg.solve(gram, np.einsum("pjr,pr->pj", rows, goal)[..., None])[..., 0]
