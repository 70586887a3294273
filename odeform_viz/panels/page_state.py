"""Saving and restoring the state of the page."""

import viser

from odeform.errors import InputError
from odeform_viz.page import Page, Panel
from odeform_viz.panels.uploads import content_of, take_upload
from odeform_viz.view import Sight

__all__ = ["StatePanel"]


class StatePanel(Panel):
    """A button for each."""

    def __init__(self, page: Page) -> None:
        self._page, gui = page, page.server.gui
        self._file = f"odeform-{page.schema.scene}.json"
        with gui.add_folder("State of the page"):
            hint = "columns, parameters, time and camera, as a small file"
            save = gui.add_button("Save state", color="gray", hint=hint)
            save.on_click(lambda event: self._save(event.client))
            restore = gui.add_upload_button("Restore state", color="gray", mime_type="application/json")
            restore.on_upload(lambda event: self._restore(take_upload(event)))

    def _save(self, client: viser.ClientHandle | None) -> None:
        if client is None:
            return
        try:
            sight = Sight.of(client.camera.position, client.camera.look_at)
            client.send_file_download(self._file, self._page.save(sight), save_immediately=True)
        except InputError as error:
            self._page.notices.show("State not saved", str(error))

    def _restore(self, file: viser.UploadedFile) -> None:
        try:
            notes = self._page.restore(content_of(file))
        except (InputError, OSError) as error:
            self._page.notices.show("State not restored", str(error))
            return
        for note in notes:
            self._page.notices.show("State restored in part", note)
