"""Composes the viewer: server, session, panels, scene and the loop that joins them."""

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from odeform.errors import InputError
from odeform.identification.pushed.recorded import Recorded
from odeform.locks import Lock
from odeform.models.titles import subject_of
from odeform_viz.browser.scripts import run_scripts
from odeform_viz.columns import Column, Columns, columns_under
from odeform_viz.layout import Layout
from odeform_viz.page import Page, Panel
from odeform_viz.panels.registry import PANELS, Entry, build_panels
from odeform_viz.presenter import Presenter
from odeform_viz.recording.control import RecordingControl
from odeform_viz.rendering.scene import SceneView
from odeform_viz.runtime.access import Access, reachable_address
from odeform_viz.runtime.clock import Clock
from odeform_viz.runtime.memory import Tidier, share_memory
from odeform_viz.runtime.notices import Notices
from odeform_viz.runtime.server import clear_page, open_server, stop_server
from odeform_viz.runtime.worker import Worker
from odeform_viz.session import Session
from odeform_viz.view import Coloring, Description, DisplayOptions, Frame, ViewRequest, played_until
from odeform_viz.workspace import Workspace

__all__ = ["App"]

FIRST_IMPACT = 3.0  # s that the first impact takes when the page opens
P = TypeVar("P", bound=Panel)


class App:
    """A served page. The newest request wins: it is computed and shown, older ones are dropped."""

    def __init__(
        self,
        columns: Sequence[Column],
        host: str = "127.0.0.1",
        port: int = 8080,
        record: str | None = None,
        panels: Sequence[Entry] = PANELS,
        origins: Sequence[str] = (),
        workspace: str | Path = ".",
    ) -> None:
        """Serve the page and start playing. Pages of other addresses are refused unless `origins` names them.

        The first column must be a model; its schema gives the sliders. If a column is a recorded sequence, the sliders
        start at its parameters. `record` is a `.rrd` file to record to from the start. Paths that come from the page
        stay inside of the folder `workspace`.

        `InputError` for a port in use, columns of different scenes, or a recording that cannot be written.
        """
        Columns.of(columns)  # wrong ones are refused before anything starts
        share_memory()
        # threads of a matrix product wait for each other: with one core busy, two take ten times as long as one
        self._threads = threadpool_limits(1, "blas")
        self._tidy = Tidier()
        self._access = Access.of(host, origins)
        self.server = open_server(self._access, port, _title(columns))
        try:
            self.recording = RecordingControl(record, lambda: bool(self.server.get_clients()))
        except InputError:
            stop_server(self.server)
            raise
        self._panels, self._workspace, self._switching = panels, workspace, Lock()
        self._experiments = list[Recorded]()
        self._build(columns)

    def _build(self, columns: Sequence[Column], parameters: Mapping[str, Any] | None = None) -> None:
        """Build a page for these columns on the server, with sliders at `parameters`, and start it."""
        self.columns = Columns.of(columns)
        self.session = Session(columns[0].source.schema)
        window = self.session.schema.window
        self.clock = Clock(window.start, played_until(window))
        self._worker = Worker(lambda: self.presenter.serve())
        self.page = Page(
            self.server,
            self.columns,
            self.session,
            self.clock,
            self.recording,
            Notices(self.server),
            self._worker.wake,
            Layout(self.server),
            Workspace.of(self._workspace, columns),
            self._experiments,
        )
        self.page.controls.show_load = self.show_load
        build_panels(self.page, self._panels)
        run_scripts(self.server)
        extent = float(np.ptp(columns[0].geometry.points, axis=0).max())
        controls = self.page.controls
        self.scene = SceneView(self.server, extent, self._worker.wake, controls.pick, controls.pull)
        controls.fit_view, controls.look = self.scene.fit, self.scene.look
        self.page.shown = lambda: self.presenter.frame
        self.presenter = Presenter(
            self.session, self.clock, self._read, self, self.recording, lambda: self._worker.up_to_date
        )
        for column in columns:
            if column.truth:
                self.page.controls.set_parameters(self.session.schema.known(column.truth.setting))
        if parameters:
            self.page.controls.set_parameters(parameters)
        self.server.on_client_connect(lambda _: self._worker.wake())  # recordings wait for somebody who watches
        self._play_first()
        self._worker.start()

    def show_load(self, load: str, parameters: Mapping[str, Any] | None = None) -> None:
        """Build the page anew, with its models under another load; models that know one scene only are left out.

        `parameters` are what its sliders then show, defaults for the others.

        `InputError` while a recording, which is of one scene, is in progress, and if the page cannot be built; the page
        before is then there again.
        """
        with self._switching:
            if self.recording.active:
                raise InputError("a recording is of one scene: stop it before something else happens")
            before, columns = self.columns.all, columns_under(self.columns.all, load)
            try:
                self._rebuild(columns, parameters)
            except Exception as error:  # of any panel, also a plugged one: the page must not stay half built
                self._rebuild(before)
                raise InputError(f"load {load!r}: its page could not be built: {error}") from error

    def _rebuild(self, columns: Sequence[Column], parameters: Mapping[str, Any] | None = None) -> None:
        self._end_page()
        self.scene.close()
        with clear_page(self.server):
            self.server.gui.set_panel_label(_title(columns))
            self._build(columns, parameters)

    def _end_page(self) -> None:
        self.page.ended = True
        for panel in self.page.panels:
            panel.close()
        self._worker.stop()

    def _play_first(self) -> None:
        """Play slowly through the first impact, then at the chosen speed."""
        with contextlib.suppress(InputError):  # the page says what is wrong with the request
            self.clock.slow_down_once(*self.session.first_impact(self.request()), FIRST_IMPACT)
        self.clock.play()

    @property
    def url(self) -> str:
        """Address of the page: for a browser on this machine, or for others if the server accepts them."""
        host = reachable_address(self._access.host)
        return f"http://{f'[{host}]' if ':' in host else host}:{self.server.get_port()}"

    def panel(self, kind: type[P]) -> P:
        """Returns the panel of that class."""
        return next(panel for panel in self.page.panels if isinstance(panel, kind))

    def request(self) -> ViewRequest:
        """The newest request of the page; see `Page.request`."""
        return self.page.request()

    def close(self) -> None:
        """Stop serving, end what panels have started, and complete the recording."""
        self._end_page()
        stop_server(self.server)
        self._threads.restore_original_limits()
        self.recording.close()

    def _read(self) -> tuple[ViewRequest, DisplayOptions]:
        options = replace(self.page.options(), viewport=self.scene.viewport)
        if self.page.controls.arranging():
            # the gizmo is where the first column would be alone
            options = replace(options, overlay=True)
        return self.page.request(), options

    def publish(self, frame: Frame, options: DisplayOptions, coloring: Coloring | None) -> None:
        """Draw a frame; see `Output`."""
        self.scene.publish(frame, options, coloring)

    def describe(self, description: Description) -> None:
        """Update all panels; see `Output`."""
        for panel in self.page.panels:
            panel.describe(description)

    def outdate(self) -> None:
        """Mark what the panels show as that of other motions; see `Output`."""
        for panel in self.page.panels:
            panel.outdate()

    def show_error(self, message: str) -> None:
        """Say in the panels why a request cannot be met; see `Output`."""
        for panel in self.page.panels:
            panel.show_error(message)

    def settle(self) -> None:
        """Return unused memory to the system; see `Output`."""
        self._tidy()


def _title(columns: Sequence[Column]) -> str:
    schema = columns[0].source.schema
    return f"ODeform · {'soft objects' if schema.objects else subject_of(schema.scene, '')}"
