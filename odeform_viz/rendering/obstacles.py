"""The walls, steps and slopes that a body meets."""

import numpy as np
import viser

from odeform.motion.base import Motion
from odeform.motion.recorded import RecordedMotion
from odeform_viz.colors import BACKGROUND
from odeform_viz.obstacles import obstacles_of

__all__ = ["ObstacleView"]

OPACITY = 0.6  # a wall hides neither the body behind it nor the next column


class ObstacleView:
    """Stands on the floor under a column, and changes with the parameters of its motion."""

    def __init__(self, server: viser.ViserServer, root: str) -> None:
        """`root` is the scene node of the floor."""
        self._scene, self._root = server.scene, root
        self._motion: Motion | RecordedMotion | None = None
        self._nodes: list[viser.MeshHandle] = []
        self._sent: list[bytes] = []

    def show(self, motion: Motion | RecordedMotion) -> None:
        """Show the obstacles of a motion; sent only when they change."""
        if motion is self._motion:
            return
        self._motion = motion
        meshes = [obstacle.mesh for obstacle in obstacles_of(motion)]
        keys = [mesh.points.tobytes() for mesh in meshes]
        if keys == self._sent:
            return
        for node in self._nodes:
            node.remove()
        self._sent = keys
        self._nodes = [
            self._scene.add_mesh_simple(
                f"{self._root}/obstacle_{index}",
                # corners of each face by themselves, so that edges are sharp
                mesh.points[mesh.faces].reshape(-1, 3),
                np.arange(3 * len(mesh.faces), dtype=np.uint32).reshape(-1, 3),
                color=BACKGROUND,
                flat_shading=True,
                opacity=OPACITY,
                cast_shadow=False,  # it would shade its own edges
            )
            for index, mesh in enumerate(meshes)
        ]
