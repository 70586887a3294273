"""A shape of the user's own as a soft body: made in a process of its own, which can be cancelled."""

from dataclasses import replace
from pathlib import Path

import viser

from odeform.errors import InputError
from odeform.formats.bundled import moving_part
from odeform.types import Geometry
from odeform_viz.fitting import MOST_POINTS, readable_shape
from odeform_viz.page import Page, Panel
from odeform_viz.panels.callbacks import LOCK, serialized
from odeform_viz.panels.material import MaterialChoice
from odeform_viz.panels.teach import Teaching
from odeform_viz.panels.uploads import path_of, take_upload
from odeform_viz.runtime.jobs import Job, make_user_body
from odeform_viz.state import PageState
from odeform_viz.user_bodies import (
    UserBody,
    describe_user_body,
    takes_user_bodies,
    user_body_of,
    with_user_body,
    without_user_body,
)

__all__ = ["UserBodyPanel"]

TRAINED = (
    "These are the bodies that the model was trained on. Another solid body can be loaded and pushed as well: a mesh, "
    "which may have defects, points, or splats."
)
BREAK = "_\u200b"  # names of files are long, and the panel is narrow
WORKING = (
    "**{}** is being filled with tetrahedra and laid on the floor. It takes five seconds on an idle machine, and "
    "longer beside other work."
)


class UserBodyPanel(Panel):
    """Loads a shape, and goes back to the trained bodies."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self._job: Job | None = None
        gui = page.server.gui
        with gui.add_folder("Shape", expand_by_default=False):
            self._text = gui.add_markdown(TRAINED)
            hint = f"a mesh, points or Gaussian splats of one solid body, up to {MOST_POINTS:,} points"
            self._load = gui.add_upload_button("Load a shape...", color="gray", hint=hint)
            self._load.on_upload(lambda event: self._upload(take_upload(event)))
            self._bar = gui.add_progress_bar(100.0, visible=False, animated=True)  # how far it is is not known
            self._cancel = gui.add_button("Cancel", color="gray", visible=False)
            self._cancel.on_click(serialized(self._give_up))
            self._back = gui.add_button("Back to the trained bodies", color="gray", visible=False)
            self._back.on_click(serialized(self._go_back))
            self._material = MaterialChoice(page, self._remake)
            self._teaching = Teaching(page, page.columns_changed)
        self._show()

    @classmethod
    def needed(cls, page: Page) -> bool:
        predictor = page.model.predictor
        return predictor is not None and takes_user_bodies(predictor)

    def restore(self, state: PageState) -> None:
        self._material.set((state.shape or {}).get("material"))
        self._show()

    def close(self) -> None:
        """Cancel the work in progress, if any."""
        self._teaching.close()
        if self._job is not None and self._job.running:
            self._job.cancel()

    def load(self, path: str | Path, name: str, origin: str) -> None:
        """Make a body of a file in another process, and show it. `InputError` for a file that cannot be read."""
        self._make(moving_part(*readable_shape(path)), name, origin)

    def _make(self, geometry: Geometry, name: str, origin: str) -> None:
        with LOCK:
            self.close()
            args = (geometry, name, self._material.value())
            self._job = Job(make_user_body, args, lambda body: self._made(body, origin), self._failed)
            self._working(WORKING.format(name.replace("_", BREAK)))
            self._job.start()

    def _remake(self) -> None:
        """Make the same shape of another material."""
        body = user_body_of(self._page.model.predictor)
        if body is None:
            return
        try:
            self._make(body.fit.source, body.item.name, body.fit.origin)
        except InputError as error:
            self._failed(str(error))

    def _upload(self, file: viser.UploadedFile) -> None:
        try:
            with path_of(file) as path:
                self.load(path, file.name, origin="")
        except (InputError, OSError) as error:  # also of the material
            self._failed(str(error))

    def _made(self, body: UserBody, origin: str) -> None:
        with LOCK:
            made = replace(body, fit=replace(body.fit, origin=origin))
            self._page.columns.change(lambda columns: with_user_body(columns, made))
            self._show()
        self._page.clock.seek(self._page.schema.window.start)
        self._page.columns_changed()

    def _failed(self, message: str) -> None:
        self._page.notices.show("Shape not loaded", message)
        self._show()
        self._text.content = f"⚠ **{message}**"  # stays after the notification

    def _give_up(self) -> None:
        self.close()
        self._show()

    def _go_back(self) -> None:
        self._page.columns.change(without_user_body)
        self._show()
        self._page.columns_changed()

    def _working(self, text: str) -> None:
        self._text.content, self._load.visible = text, False
        self._bar.visible = self._cancel.visible = True
        self._teaching.show(None)

    def _show(self) -> None:
        body = user_body_of(self._page.model.predictor)
        self._text.content = TRAINED if body is None else describe_user_body(body).replace("_", BREAK)
        self._back.visible, self._load.visible = body is not None, True
        self._bar.visible = self._cancel.visible = False
        self._teaching.show(body)
