"""Handles that the user drags in the scene: a region that selects a part, and the transform of a shape."""

from collections.abc import Callable

import numpy as np
import viser
import viser.transforms as vtf

from odeform.geometry.region import Box, Region, Sphere
from odeform.geometry.shape import FittedShape
from odeform.geometry.similarity import Similarity
from odeform.types import Floats, Rotations, Vector
from odeform_viz.colors import HANDLE

__all__ = ["CameraFocus", "RegionGizmo", "TransformGizmo", "half_extent"]

PREVIEW_POINTS = 4000  # drawn while a shape is being dragged
DIRECTION = np.array([-0.85, -0.62, 0.62])  # from the target to the camera
PANEL = np.array([0.16, -0.28, 0.0])  # shifts the view away from the control panel


class CameraFocus:
    """Moves the cameras of all clients to a target, and back to where they were."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._saved: dict[int, tuple[Floats, Floats]] = {}

    def look_at(self, centre: Vector, radius: float) -> None:
        """Show `radius` metres around `centre` (3,)."""
        for key, client in self._server.get_clients().items():
            self._saved.setdefault(key, (client.camera.position, client.camera.look_at))
            _move(client, centre + (DIRECTION + PANEL) * 3.0 * radius, centre + PANEL * radius)

    def restore(self) -> None:
        """Move the cameras back to where they were before `look_at`."""
        for key, client in self._server.get_clients().items():
            if key in self._saved:
                _move(client, *self._saved[key])
        self._saved.clear()


def _move(client: viser.ClientHandle, position: Floats, look_at: Floats) -> None:
    with client.atomic():
        # position first: setting it also translates the target
        client.camera.position = position
        client.camera.look_at = look_at


class RegionGizmo:
    """A sphere or a box with arrows to drag it by, in the metres of the scene."""

    ROOT = "/world/region"

    def __init__(self, server: viser.ViserServer, moved: Callable[[], None]) -> None:
        """`moved` is called whenever the user drags the region."""
        self._server, self._moved = server, moved
        self._visible: tuple[Region, viser.TransformControlsHandle] | None = None

    def show(self, region: Region) -> None:
        """Show a region instead of the previous one."""
        sphere = isinstance(region, Sphere)
        with self._server.atomic():
            self.hide()
            controls = self._server.scene.add_transform_controls(
                self.ROOT,
                scale=2.5 * half_extent(region),
                disable_rotations=sphere,
                position=region.centre,
                wxyz=vtf.SO3.from_matrix(np.eye(3) if sphere else region.rotation).wxyz,
            )
            # wireframe: any transparent surface would hide the splats behind it
            node, scene = f"{self.ROOT}/edges", self._server.scene
            if sphere:
                scene.add_icosphere(node, region.radius, HANDLE, subdivisions=2, wireframe=True, cast_shadow=False)
            else:
                scene.add_box(node, HANDLE, region.size, wireframe=True, cast_shadow=False)
            self._visible = region, controls
        controls.on_update(lambda _: self._moved())

    def hide(self) -> None:
        """Remove the region from the scene."""
        if self._visible is not None:
            self._visible[1].remove()
            self._visible = None

    @property
    def region(self) -> Region | None:
        """The region as dragged; None while hidden."""
        if self._visible is None:
            return None
        region, controls = self._visible
        centre = np.asarray(controls.position, dtype=float)
        if isinstance(region, Sphere):
            return Sphere(centre, region.radius)
        return Box(centre, region.size, _rotation(controls))


class TransformGizmo:
    """Arrows and rings around a fitted shape. A preview of its points moves with them until the user lets go."""

    ROOT = "/world/place"

    def __init__(self, server: viser.ViserServer, moved: Callable[[Similarity], None]) -> None:
        """`moved` is called with the rigid motion, in the metres of the scene, when a drag ends."""
        self._server, self._moved = server, moved
        self._controls: viser.TransformControlsHandle | None = None

    @property
    def visible(self) -> bool:
        """Whether arrows and rings are in the scene."""
        return self._controls is not None

    def show(self, fit: FittedShape) -> None:
        """Show arrows and rings around the moving part of a fit."""
        points = np.asarray(fit.geometry.points, dtype=float)
        low, high = points.min(axis=0), points.max(axis=0)
        start, size = 0.5 * (low + high), float((high - low).max())
        with self._server.atomic():
            self.hide()
            controls = self._server.scene.add_transform_controls(self.ROOT, scale=1.6 * size, position=start)
            preview = np.random.default_rng(0).permutation(points - start)[:PREVIEW_POINTS].astype(np.float32)
            self._server.scene.add_point_cloud(
                f"{self.ROOT}/preview",
                preview,
                HANDLE,
                point_size=0.004 * size,
                point_shape="circle",
                precision="float32",
            )
            self._controls = controls
        foot = start - [0.0, 0.0, fit.lift]  # a lifted shape is moved where it stands

        def dragged(event: viser.TransformControlsEvent) -> None:
            if event.phase == "end":
                turn, shift = _rotation(controls), np.asarray(controls.position, dtype=float) - start
                self._moved(Similarity(1.0, turn, shift + foot - turn @ foot))

        controls.on_update(dragged)

    def hide(self) -> None:
        """Remove arrows, rings and preview from the scene."""
        if self._controls is not None:
            self._controls.remove()
            self._controls = None


def half_extent(region: Region) -> float:
    """Returns metres from the centre of a region to its farthest face."""
    return region.radius if isinstance(region, Sphere) else 0.5 * float(np.max(region.size))


def _rotation(controls: viser.TransformControlsHandle) -> Rotations:
    return vtf.SO3(np.asarray(controls.wxyz, dtype=float)).as_matrix()
