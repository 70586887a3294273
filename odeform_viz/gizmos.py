"""What one drags in the scene: a region that chooses a part, and a shape that is put into place."""

from collections.abc import Callable

import numpy as np
import viser
import viser.transforms as vtf

from odeform.geometry.region import Box, Region, Sphere
from odeform.geometry.shape import Fit
from odeform.geometry.similarity import Similarity
from odeform.types import Floats, Rotations

__all__ = ["PlaceGizmo", "RegionGizmo"]

COLOR = (214, 96, 48)
VEIL, LINES = 0.16, 0.5  # opacities of a region and its edges
GHOST = 4000  # points that show where a shape is being put


class RegionGizmo:
    """A sphere or a box with arrows to drag it by, in the scene's metres."""

    ROOT = "/world/region"

    def __init__(self, server: viser.ViserServer, moved: Callable[[], None]) -> None:
        """`moved` is called whenever a hand has moved it."""
        self._server, self._moved = server, moved
        self._controls: viser.TransformControlsHandle | None = None
        self._size: Floats | float = 0.0

    def show(self, region: Region) -> None:
        """At that place; a region of another kind or size replaces the one before."""
        with self._server.atomic():
            self.hide()
            self._size = region.radius if isinstance(region, Sphere) else np.asarray(region.size, dtype=float)
            reach = 0.5 * float(np.max(2.0 * region.radius if isinstance(region, Sphere) else self._size))
            self._controls = self._server.scene.add_transform_controls(
                self.ROOT,
                scale=1.6 * reach,
                disable_rotations=isinstance(region, Sphere),
                depth_test=False,
                position=region.centre,
                wxyz=_quaternion(np.eye(3) if isinstance(region, Sphere) else region.rotation),
            )
            self._controls.on_update(lambda _: self._moved())
            for name, wireframe, opacity in (("veil", False, VEIL), ("lines", True, LINES)):
                at, look = f"{self.ROOT}/{name}", {"wireframe": wireframe, "opacity": opacity, "cast_shadow": False}
                if isinstance(region, Sphere):
                    self._server.scene.add_icosphere(
                        at, region.radius, COLOR, subdivisions=2 if wireframe else 4, **look
                    )
                else:
                    self._server.scene.add_box(at, COLOR, tuple(self._size), **look)

    def hide(self) -> None:
        if self._controls is not None:
            self._controls.remove()
            self._controls = None

    @property
    def region(self) -> Region | None:
        """As it now lies; None while hidden."""
        if self._controls is None:
            return None
        centre = np.asarray(self._controls.position, dtype=float)
        if isinstance(self._size, float):
            return Sphere(centre, self._size)
        return Box(centre, self._size, _rotation(self._controls))


class PlaceGizmo:
    """Arrows and rings about a fitted shape, with a ghost of it that goes along until the hand lets go."""

    ROOT = "/world/place"

    def __init__(self, server: viser.ViserServer, moved: Callable[[Similarity], None]) -> None:
        """`moved` is called with the motion, in the scene's metres, when a hand has let go."""
        self._server, self._moved = server, moved
        self._controls: viser.TransformControlsHandle | None = None

    def show(self, fit: Fit) -> None:
        points = np.asarray(fit.geometry.points, dtype=float)
        low, high = points.min(axis=0), points.max(axis=0)
        # what is lifted is moved where it stands
        start, lift = 0.5 * (low + high), np.array([0.0, 0.0, fit.lift])
        with self._server.atomic():
            self.hide()
            controls = self._server.scene.add_transform_controls(
                self.ROOT, scale=0.9 * float((high - low).max()), depth_test=False, position=start
            )
            ghost = (points - start)[:: -(-len(points) // GHOST)].astype(np.float32)
            self._server.scene.add_point_cloud(
                f"{self.ROOT}/ghost", ghost, COLOR, point_size=0.008 * float((high - low).max()), precision="float32"
            )
        self._controls = controls

        def dragged(event: viser.TransformControlsEvent) -> None:
            if event.phase == "end":
                turn = _rotation(controls)
                self._moved(Similarity(1.0, turn, np.asarray(controls.position) - lift - turn @ (start - lift)))

        controls.on_update(dragged)

    def hide(self) -> None:
        if self._controls is not None:
            self._controls.remove()
            self._controls = None


def _quaternion(rotation: Rotations) -> Floats:
    return vtf.SO3.from_matrix(rotation).wxyz


def _rotation(controls: viser.TransformControlsHandle) -> Rotations:
    return vtf.SO3(np.asarray(controls.wxyz, dtype=float)).as_matrix()
