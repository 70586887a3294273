"""Which part of a shape moves: all of it, or what lies in a sphere or a box that one drags."""

from collections.abc import Callable

import numpy as np
import viser

from odeform.geometry.region import Box, Region, Sphere
from odeform.geometry.shape import FittedShape, without_outliers
from odeform_viz.panels.callbacks import LOCK, on_user_change, serialized
from odeform_viz.rendering.gizmos import CameraFocus, RegionGizmo, half_extent

__all__ = ["PartPanel", "region_like"]

KINDS: tuple[str, ...] = ("everything", "sphere", "box")
FIRST = 30.0  # % of the shape's extent that a new region has


class PartPanel:
    """Shows a region over the whole shape at rest; says how much it holds; hands it on when told to."""

    def __init__(
        self,
        server: viser.ViserServer,
        whole: Callable[[], FittedShape | None],
        use: Callable[[Region | None], None],
        changed: Callable[[], None],
    ) -> None:
        """`whole` lays the whole shape out at rest and returns its fit; `use` makes a region's part move, or all;
        `changed` is called when a region comes up."""
        self._whole, self._use, self._changed = whole, use, changed
        self._fit: FittedShape | None = None
        self._gizmo, self._camera = RegionGizmo(server, self._count), CameraFocus(server)
        gui = server.gui
        self._folder = gui.add_folder("Part that moves", expand_by_default=False, visible=False)
        with self._folder:
            self._kind = gui.add_dropdown("part", KINDS, hint="the rest stands still; drag the region by its arrows")
            self._radius = gui.add_slider("radius (%)", 0.5, 100.0, 0.5, 0.5 * FIRST, hint="of the shape's extent")
            self._edges = gui.add_vector3("edges (%)", (FIRST, FIRST, FIRST), step=0.5, hint="of the shape's extent")
            self._said = gui.add_markdown("")
            self._go = gui.add_button("Use this part")
            self._change = gui.add_button("Change the region", color="gray", hint="shows it over the whole shape")
        on_user_change(self._kind, lambda: self._choose(self._kind.value))
        on_user_change(self._radius, self._resize)
        on_user_change(self._edges, self._resize)
        self._go.on_click(serialized(self._take))
        self._change.on_click(serialized(lambda: self._choose(self._kind.value)))
        self._choosing(False)

    @property
    def choosing(self) -> bool:
        """Whether a region is on show."""
        return self._gizmo.region is not None

    def show(self, fit: FittedShape | None) -> None:
        """What moves now; None for the body that was trained."""
        self._gizmo.hide()
        self._camera.restore()
        self._fit = fit
        self._folder.visible = fit is not None
        self._kind.value = _kind_of(fit.region) if fit else KINDS[0]
        self._choosing(False)

    def _choosing(self, choosing: bool) -> None:
        self._radius.visible = choosing and self._kind.value == "sphere"
        self._edges.visible = choosing and self._kind.value == "box"
        self._said.visible = self._go.visible = choosing
        self._change.visible = not choosing and self._kind.value != KINDS[0]

    def _choose(self, kind: str) -> None:
        if self._fit is None or kind not in KINDS:
            return
        if kind == KINDS[0]:
            self._use(None)
            return
        known = self._chosen() or self._fit.region
        fit = self._whole()
        if fit is None:
            return
        region, extent = region_like(known, kind, fit), _extent(fit)
        self._kind.value = kind
        if isinstance(region, Sphere):
            self._radius.value = round(100.0 * region.radius / extent, 1)
        else:
            self._edges.value = tuple(np.round(100.0 * np.asarray(region.size) / extent, 1))
        shown = region.transformed(fit.transform)
        self._camera.look_at(shown.centre, 3.0 * half_extent(shown))
        self._gizmo.show(shown)
        self._choosing(True)
        self._count()
        self._changed()

    def _resize(self) -> None:
        region = self._gizmo.region
        if region is None or self._fit is None:
            return
        share = 0.01 * self._fit.transform.factor * _extent(self._fit)
        if isinstance(region, Sphere):
            self._gizmo.show(Sphere(region.centre, share * float(self._radius.value)))
        else:
            self._gizmo.show(Box(region.centre, share * np.abs(self._edges.value), region.rotation))
        self._count()

    def _chosen(self) -> Region | None:
        """The region on show, in the units of the file."""
        region = self._gizmo.region
        return None if region is None or self._fit is None else region.transformed(self._fit.transform.inverse)

    def _count(self) -> None:
        with LOCK:  # the last to get in reads the newest place
            region = self._chosen()
            if region is not None and self._fit is not None:
                inside = int(region.contains(self._fit.source.points).sum())
                self._said.content = f"**{inside:,}** of {len(self._fit.source.points):,} points inside"

    def _take(self) -> None:
        region = self._chosen()
        if region is not None:
            self._use(region)


def region_like(known: Region | None, kind: str, fit: FittedShape) -> Region:
    """A sphere or a box in the units of the file: as known, or as large; the first in the middle of the shape."""
    if known is None:
        known = Sphere(np.median(np.asarray(fit.source.points, dtype=float), axis=0), 0.005 * FIRST * _extent(fit))
    if _kind_of(known) == kind:
        return known
    if isinstance(known, Sphere):
        # upright where the shape lies
        return Box(known.centre, np.full(3, 2.0 * known.radius), fit.transform.rotation.T)
    return Sphere(known.centre, half_extent(known))


def _kind_of(region: Region | None) -> str:
    return KINDS[0] if region is None else "sphere" if isinstance(region, Sphere) else "box"


def _extent(fit: FittedShape) -> float:
    """The largest of the whole shape but for what lies far off, in the units of the file."""
    return float(np.ptp(without_outliers(np.asarray(fit.source.points, dtype=float)), axis=0).max())
