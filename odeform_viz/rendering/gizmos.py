"""What one drags in the scene: a region that chooses a part, and a shape that is put into place."""

from collections.abc import Callable

import numpy as np
import viser
import viser.transforms as vtf

from odeform.geometry.region import Box, Region, Sphere
from odeform.geometry.shape import Fit
from odeform.geometry.similarity import Similarity
from odeform.types import Floats, Rotations, Vector

__all__ = ["PlaceGizmo", "RegionGizmo", "Vantage", "reach_of"]

COLOR = (214, 96, 48)
GHOST = 4000  # points that show where a shape is being put
ASIDE = np.array([-0.85, -0.62, 0.62])  # where things are looked at from
PANEL = np.array([0.16, -0.28, 0.0])  # what the panel covers: look past it


class Vantage:
    """Moves the cameras of all pages to see something whole, and back."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._before: dict[int, tuple[Floats, Floats]] = {}

    def look(self, centre: Vector, reach: float) -> None:
        """At a place, from as far as shows `reach` metres around it."""
        for key, client in self._server.get_clients().items():
            self._before.setdefault(key, (client.camera.position, client.camera.look_at))
            _move(client, centre + (ASIDE + PANEL) * 3.0 * reach, centre + PANEL * reach)

    def back(self) -> None:
        for key, client in self._server.get_clients().items():
            if key in self._before:
                _move(client, *self._before[key])
        self._before.clear()


def _move(client: viser.ClientHandle, position: Floats, look_at: Floats) -> None:
    with client.atomic():
        # the position first: it takes what is looked at along
        client.camera.position = position
        client.camera.look_at = look_at


class RegionGizmo:
    """A sphere or a box with arrows to drag it by, in the scene's metres."""

    ROOT = "/world/region"

    def __init__(self, server: viser.ViserServer, moved: Callable[[], None]) -> None:
        """`moved` is called whenever a hand has moved it."""
        self._server, self._moved = server, moved
        self._shown: tuple[Region, viser.TransformControlsHandle] | None = None

    def show(self, region: Region) -> None:
        """In place of the one before."""
        sphere = isinstance(region, Sphere)
        with self._server.atomic():
            self.hide()
            controls = self._server.scene.add_transform_controls(
                self.ROOT,
                scale=2.5 * reach_of(region),
                disable_rotations=sphere,
                position=region.centre,
                wxyz=vtf.SO3.from_matrix(np.eye(3) if sphere else region.rotation).wxyz,
            )
            # edges alone: a veil, however thin, would hide the splats behind it
            at, scene = f"{self.ROOT}/edges", self._server.scene
            if sphere:
                scene.add_icosphere(at, region.radius, COLOR, subdivisions=2, wireframe=True, cast_shadow=False)
            else:
                scene.add_box(at, COLOR, region.size, wireframe=True, cast_shadow=False)
            self._shown = region, controls
        controls.on_update(lambda _: self._moved())

    def hide(self) -> None:
        if self._shown is not None:
            self._shown[1].remove()
            self._shown = None

    @property
    def region(self) -> Region | None:
        """As it now lies; None while hidden."""
        if self._shown is None:
            return None
        region, controls = self._shown
        centre = np.asarray(controls.position, dtype=float)
        if isinstance(region, Sphere):
            return Sphere(centre, region.radius)
        return Box(centre, region.size, _rotation(controls))


class PlaceGizmo:
    """Arrows and rings about a fitted shape, with a ghost of it that goes along until the hand lets go."""

    ROOT = "/world/place"

    def __init__(self, server: viser.ViserServer, moved: Callable[[Similarity], None]) -> None:
        """`moved` is called with the motion, in the scene's metres, when a hand has let go."""
        self._server, self._moved = server, moved
        self._controls: viser.TransformControlsHandle | None = None

    @property
    def shown(self) -> bool:
        return self._controls is not None

    def show(self, fit: Fit) -> None:
        points = np.asarray(fit.geometry.points, dtype=float)
        low, high = points.min(axis=0), points.max(axis=0)
        start, size = 0.5 * (low + high), float((high - low).max())
        with self._server.atomic():
            self.hide()
            controls = self._server.scene.add_transform_controls(self.ROOT, scale=1.6 * size, position=start)
            ghost = np.random.default_rng(0).permutation(points - start)[:GHOST].astype(np.float32)
            self._server.scene.add_point_cloud(
                f"{self.ROOT}/ghost", ghost, COLOR, point_size=0.004 * size, point_shape="circle", precision="float32"
            )
            self._controls = controls
        foot = start - [0.0, 0.0, fit.lift]  # what is lifted is moved where it stands

        def dragged(event: viser.TransformControlsEvent) -> None:
            if event.phase == "end":
                turn, shift = _rotation(controls), np.asarray(controls.position, dtype=float) - start
                self._moved(Similarity(1.0, turn, shift + foot - turn @ foot))

        controls.on_update(dragged)

    def hide(self) -> None:
        if self._controls is not None:
            self._controls.remove()
            self._controls = None


def reach_of(region: Region) -> float:
    """Metres from its centre to its farthest side."""
    return region.radius if isinstance(region, Sphere) else 0.5 * float(np.max(region.size))


def _rotation(controls: viser.TransformControlsHandle) -> Rotations:
    return vtf.SO3(np.asarray(controls.wxyz, dtype=float)).as_matrix()
