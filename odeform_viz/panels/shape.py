"""The shape that moves: the body that was trained, a bundled one, or one from a file, as a whole or in part."""

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import viser

from odeform.errors import InputError
from odeform.formats.bundled import bundled_shapes
from odeform.geometry.region import Region
from odeform.geometry.shape import FittedShape, fit_to
from odeform.geometry.similarity import Similarity
from odeform.types import Mesh, Rotations
from odeform_viz.columns import Columns
from odeform_viz.fitting import describe_fit, shape_from
from odeform_viz.panels.alignment import AlignmentPanel
from odeform_viz.panels.callbacks import LOCK, serialized
from odeform_viz.panels.part import PartPanel

__all__ = ["ShapePanel"]

LARGEST = 256 << 20  # bytes of an upload
TRAINED = "The body that was trained."


class ShapePanel:
    """Which shape, which part of it, and how it lies; and the way back."""

    def __init__(
        self,
        server: viser.ViserServer,
        columns: Columns,
        body: Mesh,
        hold: Callable[[], None],
        changed: Callable[[], None],
        say: Callable[[str], None],
    ) -> None:
        """`hold` stops the motion at rest; `changed` is called after the columns have; `say` shows a message."""
        self._columns, self._body, self._hold, self._changed, self._say = columns, body, hold, changed, say
        self._fit = next((column.fit for column in columns.all if column.fit), None)
        self._name = "the shape"
        self._turned: Rotations | None = None  # by hand; None as guessed
        self._guess = self._fit.transform.factor if self._fit else 1.0
        gui = server.gui
        with gui.add_folder("Shape", expand_by_default=False):
            self._text = gui.add_markdown(TRAINED)
            upload = gui.add_upload_button(
                "Move another shape", color="gray", hint="a mesh, points or Gaussian splats, up to 200,000 points"
            )
            upload.on_upload(lambda event: self._guarded(lambda: self._uploaded(event.target.value)))
            for name in bundled_shapes():
                button = gui.add_button(f"Move the bundled {name}", color="gray", hint="Gaussian splats")
                button.on_click(lambda _, name=name: self._guarded(lambda: self._read(name, name, kept=True)))
            self._part = PartPanel(server, self._lay_out, self._use, changed)
            self._alignment = AlignmentPanel(server, hold, self._turn, self._put, changed)
            self._back = gui.add_button("Back to the trained body", color="gray", visible=False)
            self._back.on_click(serialized(self._return))
        self._show()

    def _guarded(self, action: Callable[[], None]) -> None:
        try:
            with LOCK:
                action()
        except (InputError, OSError) as error:
            self._say(str(error))
            self._text.content = f"⚠ **{error}**"  # what is said elsewhere goes with the next frame

    def _uploaded(self, file: viser.UploadedFile) -> None:
        if len(file.content) > LARGEST:
            raise InputError(f"{file.name}: expected at most {LARGEST >> 20} MB")
        # the readers take paths: the file exists only as long as it is read
        with tempfile.TemporaryDirectory(prefix="odeform-") as folder:
            path = Path(folder) / f"shape{Path(file.name).suffix}"
            path.write_bytes(file.content)
            try:
                self._read(path, file.name)
            except InputError as error:
                raise InputError(str(error).replace(str(path), file.name).replace(path.name, file.name)) from None

    def _read(self, path: str | Path, name: str, kept: bool = False) -> None:
        fit = shape_from(path, self._body)
        self._name, self._turned = name, None
        self._adopt(fit if kept else replace(fit, origin=""))

    def set(self, fit: FittedShape | None) -> None:
        """Another shape, or the same in another part or place; None for the body that was trained."""
        with LOCK:
            if fit is not None:
                self._name, self._turned = fit.origin, fit.transform.rotation
                self._guess = fit_to(fit.source, self._body, fit.region, fit.transform.rotation).transform.factor
            self._adopt(fit, guessed=False)

    @property
    def arranging(self) -> bool:
        """Whether a hand is choosing a part or putting the shape into place."""
        return self._part.choosing or self._alignment.dragging

    def _adopt(self, fit: FittedShape | None, guessed: bool = True) -> None:
        self._fit = fit
        if fit is not None and guessed:
            self._guess = fit.transform.factor
        self._columns.set_shape(fit)
        self._show()
        self._changed()

    def _show(self) -> None:
        self._text.content = describe_fit(self._fit, self._name, self._body) if self._fit else TRAINED
        self._back.visible = self._fit is not None
        self._part.show(self._fit)
        self._alignment.show(self._fit, self._guess)

    def _refit(self, region: Region | None, rotation: Rotations | None, transform: Similarity | None = None) -> None:
        """The same shape, otherwise; it stays as it is where that cannot be."""
        fit = self._fit
        if fit is not None:
            self._guarded(lambda: self._move(fit, region, rotation, transform))

    def _move(
        self, fit: FittedShape, region: Region | None, rotation: Rotations | None, transform: Similarity | None
    ) -> None:
        moved = fit_to(fit.source, self._body, region, rotation, transform)
        self._adopt(replace(moved, origin=fit.origin), guessed=transform is None)

    def _lay_out(self) -> FittedShape | None:
        """The whole shape at rest, upright as it was; a part taken from it then stays so."""
        if self._fit is not None:
            self._hold()
            upright = self._fit.transform.rotation
            if not np.array_equal(upright, np.eye(3)):
                self._turned = upright
            self._refit(None, upright)
        return self._fit

    def _use(self, region: Region | None) -> None:
        self._refit(region, self._turned)

    def _turn(self, rotation: Rotations | None) -> None:
        self._turned = rotation
        if self._fit is not None:
            self._refit(self._fit.region, rotation)

    def _put(self, transform: Similarity) -> None:
        self._turned = transform.rotation
        if self._fit is not None:
            self._refit(self._fit.region, None, transform)

    def _return(self) -> None:
        self._adopt(None)
