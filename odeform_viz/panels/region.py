"""Selects which part of a loaded shape moves: all of it, or what lies in a sphere or a box that the user drags."""

from collections.abc import Callable

import numpy as np
import viser

from odeform.geometry.region import Box, Region, Sphere
from odeform.geometry.shape import FittedShape, without_outliers
from odeform_viz.browser.limits import set_limits
from odeform_viz.panels.callbacks import LOCK, on_user_change, serialized
from odeform_viz.rendering.gizmos import CameraFocus, RegionGizmo, half_extent

__all__ = ["RegionEditor", "region_like"]

KINDS: tuple[str, ...] = ("everything", "sphere", "box")
EDGES = (0.1, 1000.0)  # %
INITIAL = 30.0  # % of the shape's extent that a new region has


class RegionEditor:
    """Shows a region over the whole shape at rest, and how many points are in it, until the user applies it."""

    def __init__(
        self,
        server: viser.ViserServer,
        show_whole: Callable[[], FittedShape | None],
        apply: Callable[[Region | None], None],
        changed: Callable[[], None],
    ) -> None:
        """`show_whole` shows the whole shape at rest and returns its fit; `apply` makes the part in a region move, or
        everything; `changed` is called when a region appears."""
        self._show_whole, self._apply, self._changed = show_whole, apply, changed
        self._fit: FittedShape | None = None
        self._gizmo, self._camera = RegionGizmo(server, self._count), CameraFocus(server)
        gui = server.gui
        self._folder = gui.add_folder("Moving part", expand_by_default=False, visible=False)
        with self._folder:
            self._kind = gui.add_dropdown("region", KINDS, hint="all outside of it stands still; drag it by its arrows")
            self._radius = gui.add_slider("radius (%)", 0.5, 100.0, 0.5, 0.5 * INITIAL, hint="of the shape's extent")
            self._edges = gui.add_vector3(
                "edges (%)", (INITIAL, INITIAL, INITIAL), step=0.5, hint="of the shape's extent"
            )
            set_limits(server, self._edges, *EDGES)
            self._text = gui.add_markdown("")
            self._use = gui.add_button("Use this part")
            self._change = gui.add_button("Change the region", color="gray", hint="over the whole shape")
        on_user_change(self._kind, lambda: self._choose(self._kind.value))
        on_user_change(self._radius, self._resize)
        on_user_change(self._edges, self._resize)
        self._use.on_click(serialized(self._use_region))
        self._change.on_click(serialized(lambda: self._choose(self._kind.value)))
        self._set_editing(False)

    @property
    def editing(self) -> bool:
        """Whether a region is visible."""
        return self._gizmo.region is not None

    def show(self, fit: FittedShape | None) -> None:
        """Show which part moves now; None for the trained body."""
        self._gizmo.hide()
        self._camera.restore()
        self._fit = fit
        self._folder.visible = fit is not None
        self._kind.value = _kind_of(fit.region) if fit else KINDS[0]
        self._set_editing(False)

    def _set_editing(self, editing: bool) -> None:
        self._radius.visible = editing and self._kind.value == "sphere"
        self._edges.visible = editing and self._kind.value == "box"
        self._text.visible = self._use.visible = editing
        self._change.visible = not editing and self._kind.value != KINDS[0]

    def _choose(self, kind: str) -> None:
        if self._fit is None or kind not in KINDS:
            return
        if kind == KINDS[0]:
            self._apply(None)
            return
        last = self._edited() or self._fit.region
        fit = self._show_whole()
        if fit is None:
            return
        region, extent = region_like(last, kind, fit), _extent(fit)
        self._kind.value = kind
        if isinstance(region, Sphere):
            self._radius.value = round(100.0 * region.radius / extent, 1)
        else:
            self._edges.value = tuple(np.round(100.0 * np.asarray(region.size) / extent, 1))
        in_scene = region.transformed(fit.transform)
        self._camera.look_at(in_scene.centre, 3.0 * half_extent(in_scene))
        self._gizmo.show(in_scene)
        self._set_editing(True)
        self._count()
        self._changed()

    def _resize(self) -> None:
        region = self._gizmo.region
        if region is None or self._fit is None:
            return
        metres_per_percent = 0.01 * self._fit.transform.factor * _extent(self._fit)
        if isinstance(region, Sphere):
            self._gizmo.show(Sphere(region.centre, metres_per_percent * float(self._radius.value)))
        else:
            self._gizmo.show(
                Box(region.centre, metres_per_percent * np.clip(self._edges.value, *EDGES), region.rotation)
            )
        self._count()

    def _edited(self) -> Region | None:
        """The visible region, in the units of the file."""
        region = self._gizmo.region
        return None if region is None or self._fit is None else region.transformed(self._fit.transform.inverse)

    def _count(self) -> None:
        with LOCK:  # of several callbacks at once, the last reads the newest region
            region = self._edited()
            if region is not None and self._fit is not None:
                inside = int(region.contains(self._fit.source.points).sum())
                self._text.content = f"**{inside:,}** of {len(self._fit.source.points):,} points inside"

    def _use_region(self) -> None:
        region = self._edited()
        if region is not None:
            self._apply(region)


def region_like(last: Region | None, kind: str, fit: FittedShape) -> Region:
    """Returns a "sphere" or "box" in the units of the file: `last`, one of its size, or a first one in the middle."""
    if last is None:
        last = Sphere(np.median(np.asarray(fit.source.points, dtype=float), axis=0), 0.005 * INITIAL * _extent(fit))
    if _kind_of(last) == kind:
        return last
    if isinstance(last, Sphere):
        # upright in the scene
        return Box(last.centre, np.full(3, 2.0 * last.radius), fit.transform.rotation.T)
    return Sphere(last.centre, half_extent(last))


def _kind_of(region: Region | None) -> str:
    return KINDS[0] if region is None else "sphere" if isinstance(region, Sphere) else "box"


def _extent(fit: FittedShape) -> float:
    """The largest extent of the whole shape without outliers, in the units of the file."""
    return float(np.ptp(without_outliers(np.asarray(fit.source.points, dtype=float)), axis=0).max())
