"""The graph of a body: nodes spread over its surface, joined to their neighbours, and what a push is at each node."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from odeform.models.contact.inputs import VECTORS, has_contact
from odeform.motion.point_motion import PointFrame
from odeform.schema import Schema
from odeform.types import Floats

__all__ = ["NodeGraph"]

NEIGHBOURS = 8
BETWEEN = 4  # nodes between which the displacement of a point is interpolated
NEAR = 1e-6  # radii of gyration


@dataclass(frozen=True, eq=False)
class NodeGraph:
    """M nodes of a body, canonical, in radii of gyration about its centre of mass; `frame` has the units."""

    nodes: Float[np.ndarray, "nodes 3"]
    frame: PointFrame

    @cached_property
    def edges(self) -> Int[np.ndarray, "2 edges"]:
        """Edges that lead from each node's nearest neighbours to the node."""
        count = min(NEIGHBOURS, len(self.nodes) - 1)
        near = np.asarray(KDTree(self.nodes).query(self.nodes, count + 1)[1])[:, 1:]
        return np.stack([near.ravel(), np.repeat(np.arange(len(self.nodes)), count)])

    @cached_property
    def along(self) -> Float[np.ndarray, "edges 4"]:
        """Offset and distance along each edge, in radii of gyration."""
        offset = self.nodes[self.edges[0]] - self.nodes[self.edges[1]]
        return np.concatenate([offset, np.linalg.norm(offset, axis=1, keepdims=True)], axis=1).astype(np.float32)

    def features(
        self, schema: Schema, theta: Float[np.ndarray, "cases parameters"]
    ) -> Float[np.ndarray, "cases nodes _"]:
        """Returns the inputs of the network at each node, float32: its position, the parameters `theta` in [-1, 1],
        and, in scenes with a contact, offset and distance from the contact and the torque about the centre of mass."""
        shape = (len(theta), len(self.nodes))
        parts = [np.broadcast_to(self.nodes, (*shape, 3)), np.broadcast_to(theta[:, None], (*shape, theta.shape[1]))]
        if has_contact(schema):
            contact, force = self._push(schema, theta)
            offset, torque = self.nodes - contact[:, None], np.cross(contact, force)
            parts += [offset, np.linalg.norm(offset, axis=2, keepdims=True)]
            parts += [np.broadcast_to(torque[:, None], (*shape, 3))]
        return np.concatenate(parts, axis=2).astype(np.float32)

    def _push(self, schema: Schema, theta: Floats) -> tuple[Floats, Floats]:
        """(S, 3) contacts in radii of gyration about the centre of mass, and (S, 3) forces in units of the largest."""
        values = {
            p.name: np.array([p.denormalise(float(u)) for u in theta[:, i]]) for i, p in enumerate(schema.learned)
        }
        contact, force = (np.stack([values[f"{vector}_{axis}"] for axis in "xyz"], axis=1) for vector in VECTORS)
        largest = max(p.high for p in schema.learned if p.name.startswith(VECTORS[1]))
        return (contact - np.array(self.frame.anchor)) / self.frame.gyration_radius, force / largest

    def interpolated(self, moved: Float[np.ndarray, "nodes 3"], x: Floats) -> Floats:
        """Computes (N, 3) displacements of points `x` (N, 3) in radii of gyration, by inverse distance between
        nodes."""
        count = min(BETWEEN, len(self.nodes))
        distance, index = KDTree(self.nodes).query(x, count)
        weights = 1.0 / np.maximum(distance.reshape(-1, count), NEAR) ** 2
        weights /= weights.sum(axis=1, keepdims=True)
        return np.einsum("nk,nki->ni", weights, moved[index.reshape(-1, count)])
