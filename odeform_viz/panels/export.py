"""Downloading the motion as a file."""

import tempfile
from pathlib import Path

import viser

from odeform.errors import InputError
from odeform_viz.export import export, export_formats, export_notes
from odeform_viz.page import Page, Panel
from odeform_viz.panels.figure_button import FigureButton

__all__ = ["ExportPanel"]


class ExportPanel(Panel):
    """A choice of format, and a button; and a figure with sliders."""

    def __init__(self, page: Page) -> None:
        self._page, gui, self._formats = page, page.server.gui, export_formats()
        with gui.add_folder("Export"):
            self._format = gui.add_dropdown("format", tuple(self._formats))
            download = gui.add_button(
                "Download", color="gray", hint="the first visible model, in the units of the shape's file"
            )
            download.on_click(lambda event: self._download(event.client))
            self._figure = FigureButton(page)

    def close(self) -> None:
        self._figure.close()

    def _download(self, client: viser.ClientHandle | None) -> None:
        if client is None:
            return
        try:
            if self._format.value not in self._formats:
                raise InputError(f"format: expected one of {', '.join(self._formats)}, got {self._format.value!r}")
            suffix, whole = self._formats[self._format.value]
            with tempfile.TemporaryDirectory(prefix="odeform-") as folder:
                file = export(self._page.session, self._page.request(), Path(folder) / f"motion{suffix}", whole)
                client.send_file_download(file.name, file.read_bytes(), save_immediately=True)
            if notes := export_notes(self._page.session, self._page.request(), whole):
                self._page.notices.show("Exported, but note", ". ".join(notes))
        except (InputError, OSError) as error:
            self._page.notices.show("Export failed", str(error))
