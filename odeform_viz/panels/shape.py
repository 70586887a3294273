"""The shape that moves: the trained body, a bundled shape, or one from a file, as a whole or in part."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import viser

from odeform.errors import InputError
from odeform.formats.bundled import bundled_shapes
from odeform.geometry.region import Region
from odeform.geometry.shape import FittedShape, fit_to
from odeform.geometry.similarity import UPRIGHT, Similarity
from odeform.types import Rotations
from odeform_viz.fitting import MOST_POINTS, describe_fit, shape_from
from odeform_viz.page import Page, Panel
from odeform_viz.panels.alignment import Alignment
from odeform_viz.panels.callbacks import LOCK, serialized
from odeform_viz.panels.region import RegionEditor
from odeform_viz.panels.uploads import path_of, take_upload
from odeform_viz.state import PageState
from odeform_viz.user_bodies import takes_user_bodies

__all__ = ["ShapePanel"]

TRAINED = "This is the body that the model was trained on."


class ShapePanel(Panel):
    """Loads a shape, and changes which part of it moves and how it lies; all models get the same shape."""

    def __init__(self, page: Page) -> None:
        self._page, self._body = page, page.body
        self._fit = _fit_of(page)
        self._name = "the shape"
        self._rotation: Rotations | None = None  # chosen by the user; None for the automatic one
        self._automatic_scale = self._fit.transform.factor if self._fit else 1.0
        server, gui = page.server, page.server.gui
        with gui.add_folder("Shape", expand_by_default=False):
            self._text = gui.add_markdown(TRAINED)
            upload = gui.add_upload_button(
                "Load a shape...", color="gray", hint=f"a mesh, points or Gaussian splats, up to {MOST_POINTS:,} points"
            )
            upload.on_upload(lambda event: self._guarded(lambda: self._upload(take_upload(event))))
            for name in bundled_shapes():
                button = gui.add_button(f"Load the {name}", color="gray", hint="bundled Gaussian splats")
                button.on_click(lambda _, name=name: self._guarded(lambda: self._load(name, name)))
            self._keep = gui.add_button("Keep z up", color="gray", visible=False, hint="as it lies in the file")
            self._keep.on_click(serialized(lambda: self._rotate(UPRIGHT["+z"])))
            self._region = RegionEditor(server, self._show_whole, self._use_region, page.wake)
            self._alignment = Alignment(server, self._rest, self._rotate, self._transform, page.wake)
            self._back = gui.add_button("Back to the trained body", color="gray", visible=False)
            self._back.on_click(serialized(lambda: self._adopt(None)))
        page.controls.arranging = lambda: self._region.editing or self._alignment.dragging
        self._show()

    @classmethod
    def needed(cls, page: Page) -> bool:
        predictor = page.model.predictor
        return predictor is None or not takes_user_bodies(predictor)

    def set(self, fit: FittedShape | None) -> None:
        """Takes another shape, or the same in another part or transform; None for the trained body."""
        with LOCK:
            if fit is not None:
                self._name, self._rotation = fit.origin, fit.transform.rotation
                automatic = fit_to(fit.source, self._body, fit.region, fit.transform.rotation)
                self._automatic_scale = automatic.transform.factor
            self._adopt(fit, automatic=False)

    def restore(self, state: PageState) -> None:
        self.set(_fit_of(self._page))

    def _guarded(self, action: Callable[[], None]) -> None:
        """Change the shape, or show why not."""
        try:
            with LOCK:
                action()
        except (InputError, OSError) as error:
            self._page.notices.show("Shape not loaded", str(error))
            self._text.content = f"⚠ **{error}**"  # stays after the notification

    def _upload(self, file: viser.UploadedFile) -> None:
        with path_of(file) as path:
            self._load(path, file.name, origin="")

    def _load(self, path: str | Path, name: str, origin: str | None = None) -> None:
        """`origin`, if given, replaces the path that a saved state refers to."""
        fit = shape_from(path, self._body)
        self._name, self._rotation = name, None
        self._adopt(fit if origin is None else replace(fit, origin=origin))

    def _adopt(self, fit: FittedShape | None, automatic: bool = True) -> None:
        """Show a fit in all columns; `automatic` if its scale is what 100 % means."""
        self._fit = fit
        if fit is not None and automatic:
            self._automatic_scale = fit.transform.factor
        self._show()
        self._page.columns.set_shape(fit)
        self._page.columns_changed()

    def _show(self) -> None:
        predictor, fit = self._page.model.predictor, self._fit
        similarity = predictor.validity.similarity(fit.geometry) if predictor and fit else None
        self._text.content = describe_fit(fit, self._name, similarity) if fit else TRAINED
        self._back.visible = self._fit is not None
        self._keep.visible = self._fit is not None and bool(self._fit.upright)
        self._region.show(self._fit)
        self._alignment.show(self._fit, self._automatic_scale)

    def _refit(self, region: Region | None, rotation: Rotations | None, transform: Similarity | None = None) -> None:
        """FittedShape the same shape again; it stays as it is where that is impossible."""
        fit = self._fit
        if fit is None:
            return

        def refit() -> None:
            moved = fit_to(fit.source, self._body, region, rotation, transform)
            self._adopt(replace(moved, origin=fit.origin), automatic=transform is None)

        self._guarded(refit)

    def _rest(self) -> None:
        self._page.pause_at(self._page.schema.window.start)

    def _show_whole(self) -> FittedShape | None:
        """Show the whole shape at rest, with its present rotation; a part selected from it keeps that."""
        if self._fit is not None:
            self._rest()
            rotation = self._fit.transform.rotation
            if not np.array_equal(rotation, np.eye(3)):
                self._rotation = rotation
            self._refit(None, rotation)
        return self._fit

    def _use_region(self, region: Region | None) -> None:
        self._refit(region, self._rotation)

    def _rotate(self, rotation: Rotations | None) -> None:
        self._rotation = rotation
        if self._fit is not None:
            self._refit(self._fit.region, rotation)

    def _transform(self, transform: Similarity) -> None:
        self._rotation = transform.rotation
        if self._fit is not None:
            self._refit(self._fit.region, None, transform)


def _fit_of(page: Page) -> FittedShape | None:
    """The fit of the shape that the columns have now."""
    return next((column.fit for column in page.columns.all if column.fit), None)
