"""Defines what a panel is and what it is built from."""

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import viser

from odeform.identification.pushed.recorded import Recorded
from odeform.schema import Schema
from odeform.types import Mesh, Vector
from odeform_viz.columns import Column, Columns
from odeform_viz.fitting import fit_from_json
from odeform_viz.layout import Layout
from odeform_viz.pushing import ShownPush
from odeform_viz.recording.control import RecordingControl
from odeform_viz.runtime.clock import Clock
from odeform_viz.runtime.notices import Notices
from odeform_viz.session import Session
from odeform_viz.state import PageState, capture, columns_of, state_from_json, state_to_json
from odeform_viz.user_bodies import read_user_body, takes_user_bodies, with_user_body
from odeform_viz.view import Description, DisplayOptions, Frame, Sight, ViewRequest
from odeform_viz.workspace import Workspace

__all__ = ["Controls", "Page", "Panel"]


class Panel:
    """A part of the page. The constructor builds its controls; `panels.registry` says where they stand.

    All other methods may stay as they are. `describe` and `show_error` are called on the worker's thread.
    """

    def __init__(self, page: "Page") -> None:
        """Add controls to `page.server.gui`."""

    @classmethod
    def needed(cls, page: "Page") -> bool:
        """Whether this page has any use for the panel; otherwise it is not built."""
        return True

    def describe(self, description: Description) -> None:
        """Show what belongs to a frame; called several times a second while frames change."""

    def outdate(self) -> None:
        """Mark what belongs to other motions than those in view, until the next `describe`."""

    def show_error(self, message: str) -> None:
        """Say why the newest request cannot be met."""

    def restore(self, state: PageState) -> None:
        """Move the panel's controls to a saved state. The columns are already restored."""

    def close(self) -> None:
        """End the panel's work in other processes."""


@dataclass
class Controls:
    """The controls that more than one panel needs. Panels that build them replace these defaults."""

    parameters: Callable[[], dict[str, Any]] = dict
    """The values of the sliders. `InputError` for values that no slider can have."""
    set_parameters: Callable[[Mapping[str, Any]], None] = lambda _: None
    """Moves the sliders of these names."""
    pick: Callable[[Column | None, Vector], None] | None = None
    """Told of a click: the column, and the point (3,) m of its shape at rest; None beside all. Unset in scenes that
    have no use for clicks."""
    pull: Callable[[ShownPush, Vector, str], None] | None = None
    """Told of the arrow of a force being dragged: the push, where its tail is (3,) m, and the phase of the drag."""
    show_load: Callable[[str, Mapping[str, Any]], None] = lambda *_: None
    """Builds the page anew, with its models under another load, and its sliders at parameters; others at defaults."""
    quality: Callable[[], str] = lambda: "balanced"
    overlay: Callable[[], bool] = lambda: False
    set_overlay: Callable[[bool], None] = lambda _: None
    """Shows all columns in one place, or side by side again."""
    time_slider: str = ""
    """The id of the time slider in the page, for scripts; empty if there is none."""
    drawing: Callable[[], DisplayOptions] = DisplayOptions
    """How bodies are drawn, but for `overlay`."""
    fit_view: Callable[[], None] = lambda: None
    """Aims the cameras at all columns again."""
    look: Callable[[Sight], None] = lambda _: None
    """Aims the cameras at a sight that was saved, once."""
    arranging: Callable[[], bool] = lambda: False
    """Whether a shape is being placed, for which all columns are overlaid."""


@dataclass
class Page:
    """One page: the server, the columns, and the services that panels share."""

    server: viser.ViserServer
    columns: Columns
    session: Session
    clock: Clock
    recording: RecordingControl
    notices: Notices
    wake: Callable[[], None]
    """Asks the worker to read the newest request."""
    layout: Layout
    workspace: Workspace
    experiments: list[Recorded] = field(default_factory=list)
    """Motions of known pushes, drops and throws that were fitted, whatever happened on the page since."""
    shown: Callable[[], Frame | None] = lambda: None
    """The frame on screen, if there is one."""
    controls: Controls = field(default_factory=Controls)
    panels: list[Panel] = field(default_factory=list)
    hotkeys: dict[str, str] = field(default_factory=dict)
    """Says in words what each hot key does; see `add_hotkey`."""
    ended: bool = False
    """Whether another page has taken its place: what it still had to do is left."""
    _on_columns_changed: list[Callable[[], None]] = field(default_factory=list)

    @property
    def schema(self) -> Schema:
        """Parameters of the scene."""
        return self.session.schema

    @property
    def model(self) -> Column:
        """The first model under the sliders."""
        return next(c for c in self.columns.all if c.predictor is not None and c.pinned is None)

    @property
    def body(self) -> Mesh:
        """The trained body of the first model that the parameters select; loaded shapes are fitted to it."""
        predictor = self.model.predictor
        assert predictor is not None
        return predictor.rest_of(self.controls.parameters())

    def request(self) -> ViewRequest:
        """The newest request. `InputError` for parameters or a quality that no control can have."""
        parameters = self.schema.complete(self.controls.parameters())
        self.columns.follow(parameters)
        return ViewRequest(parameters, self.clock.time(), self.controls.quality(), self.columns.all)

    def options(self) -> DisplayOptions:
        """The newest display options, as the user set them."""
        return replace(self.controls.drawing(), overlay=self.controls.overlay())

    def pause_at(self, time: float) -> None:
        """Stop playing and go to `time` in seconds."""
        self.clock.pause()
        self.clock.seek(time)
        self.wake()

    def on_event_loop(self, action: Callable[[], None]) -> None:
        """Call `action` soon, on the thread that handles the clients' messages.

        Controls that both the user and the viewer set are set there: another thread could overwrite a value that has
        arrived before its callback reads it, and the user's change would be lost. Does nothing where the page or the
        viewer has ended meanwhile.
        """

        def act() -> None:
            if not self.ended:  # its controls are gone
                action()

        with contextlib.suppress(RuntimeError):  # the loop is closed
            self.server.get_event_loop().call_soon_threadsafe(act)

    def on_columns_changed(self, action: Callable[[], None]) -> None:
        """Call `action` after each change of the columns, on the thread that changed them."""
        self._on_columns_changed.append(action)

    def columns_changed(self) -> None:
        """Tells the panels of a change of the columns or their shape."""
        for action in self._on_columns_changed:
            action()
        self.wake()

    def add_hotkey(self, keys: str, label: str, action: Callable[[], None]) -> None:
        """Register `action` under keys, separated by spaces, and in the command palette, labelled `label`.

        `ValueError` for a key that another action has.
        """
        if taken := set(keys.split()) & set(" ".join(self.hotkeys).split()):
            raise ValueError(f"hot key {', '.join(sorted(taken))}: expected one that is free")
        for key in keys.split():
            name = label.capitalize() if key == keys.split()[0] else f"{label.capitalize()} ({key})"
            command = self.server.gui.add_command(name, hotkey=key)  # pyright: ignore[reportArgumentType]
            command.on_trigger(lambda _: action())
        self.hotkeys[keys] = label

    def save(self, camera: Sight | None = None) -> bytes:
        """Returns the state of the page as a file, with the `camera` of a browser."""
        clock = self.clock
        looks = self.options(), clock.speed, clock.loop, camera
        return state_to_json(capture(self.schema.scene, self.request(), *looks))

    def restore(self, data: bytes) -> Sequence[str]:
        """Move everything to a saved state; returns notes of what it could not hold.

        `InputError` for anything but a state of this scene, and for missing files; then nothing has changed.
        """
        state = self.workspace.confined(state_from_json(data, self.schema.scene))
        columns = columns_of(state, self.schema)
        if state.shape and any(takes_user_bodies(c.predictor) for c in columns if c.predictor):
            columns = with_user_body(columns, read_user_body(state.shape["origin"], state.shape.get("material")))
        elif state.shape:
            fit = fit_from_json(state.shape, self.body)
            columns = [replace(c, geometry=fit.geometry, fit=fit) if c.predictor else c for c in columns]
        self.columns.replace_all(columns)
        for panel in self.panels:
            panel.restore(state)
        if state.camera is not None:
            self.controls.look(state.camera)
        self.columns_changed()
        return state.notes
