"""The shape at rest, translucent: what the deformation is measured from."""

import numpy as np
import viser

from odeform.types import Geometry, Mesh

__all__ = ["show_ghost"]

COLOR, OPACITY = (96, 104, 120), 0.22


def show_ghost(server: viser.ViserServer, node: str, geometry: Geometry) -> viser.SceneNodeHandle:
    """Add a shape at rest as the scene node `node`."""
    points = np.asarray(geometry.points, dtype=np.float32)
    if isinstance(geometry, Mesh):
        return server.scene.add_mesh_simple(
            node, points, geometry.faces, color=COLOR, opacity=OPACITY, cast_shadow=False, receive_shadow=False
        )
    return server.scene.add_point_cloud(node, points, COLOR, point_size=0.0015, precision="float32")
