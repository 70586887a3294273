"""The truth to compare with: a test sequence of the scene's data set, one of the user's own, or one simulated now."""

import asyncio
import threading
from collections.abc import Mapping

import numpy as np
import viser

from odeform.dataset.captured import read_captured
from odeform.dataset.index import Entry
from odeform.dataset.store import bundled_datasets, open_dataset
from odeform.errors import InputError
from odeform.identification.release import MarkerLayout, markers_in, recorded_release, released
from odeform.models.clamped import ClampedModel
from odeform.motion.recorded import RecordedMotion
from odeform.schema import OBJECT, Schema
from odeform.simulation.contacts import vector_of
from odeform.simulation.scenes.registry import find_scene
from odeform.types import MotionSequence
from odeform_viz.columns import Column
from odeform_viz.page import Page, Panel
from odeform_viz.panels.uploads import content_of, take_upload
from odeform_viz.pushing import contacts_of
from odeform_viz.runtime.jobs import Job, simulate_motion, simulate_user_body
from odeform_viz.user_bodies import simulated_item, with_own_colors
from odeform_viz.view import Description
from odeform_viz.words import constant_text, plain

__all__ = ["TruthPanel", "entry_label", "physics_difference"]

NONE, SIMULATED = "none", "simulated here"
FORMAT = "an .npz file: times (T,) in s, vertices (T, N, 3) in m; if known, faces and parameters"
RECORDING = (
    "markers of this body while it is held, let go, and comes to rest: .c3d, or .npz with times, positions, labels"
)
NO_SIMULATOR = "This scene was imported, so it cannot be simulated here."
NO_SIMULATION = "Open a recording of its markers to compare with; no simulator has this body."
OVERSAMPLING = 4  # simulated frames per frame of training, to compare between those too

PHYSICS = (
    "⚠ **The simulator's constants differ from those the model was trained on**, so errors against a simulation are "
    "not the model's alone: {}."
)


def entry_label(entry: Entry, schema: Schema) -> str:
    """Returns the number of a sequence and its parameters."""
    if contacts_of(schema):
        strength = float(np.linalg.norm(vector_of(entry.parameters, "force")))
        values = f"{entry.parameters[OBJECT]}, {strength:.3g} N"
    else:
        values = plain({p.name: entry.parameters[p.name] for p in schema.learned}, schema)
    return f"{entry.name.rsplit('_', 1)[-1].lstrip('0') or '0'}: {values}"


def physics_difference(trained: Mapping[str, float], simulated: Mapping[str, float]) -> str:
    """The constants of the simulator in which the training data differ, in words; empty if they differ in none.

    Those that act in the training data only, such as the mass of a sphere, are not of the motion that is simulated.
    """
    names = [name for name, value in simulated.items() if trained.get(name) != value]

    def known(name: str) -> str:
        return f"trained with {constant_text(name, trained[name])}" if name in trained else "not known of the training"

    return ", ".join(f"{constant_text(name, simulated[name])} ({known(name)})" for name in names)


class TruthPanel(Panel):
    """A list of test sequences, and the simulator in a process of its own."""

    def __init__(self, page: Page) -> None:
        self._page, self._schema, self._columns = page, page.schema, page.columns
        scene = self._schema.scene
        model = page.model.predictor
        self._layout = MarkerLayout(**model.markers) if isinstance(model, ClampedModel) else None
        self._scene = find_scene(scene)  # None for imported data, which cannot be simulated
        self._dataset = open_dataset(scene) if scene in bundled_datasets() else None
        self._entries = {entry_label(e, self._schema): e for e in self._dataset.select("test")} if self._dataset else {}
        self._job: Job | None = None
        self._starting = threading.Lock()
        self._opening = asyncio.Lock()  # fair: sequences are opened in the order in which they were chosen
        gui = page.server.gui
        with gui.add_folder("Truth"):
            if self._dataset is not None:
                self._browser = gui.add_dropdown("test sequence", (NONE, *self._entries))
                self._browser.on_update(self._chosen)
            kinds, hint = (".npz,.c3d", RECORDING) if self._layout else (".npz", FORMAT)
            upload = gui.add_upload_button("Open a motion...", color="gray", mime_type=kinds, hint=hint)
            upload.on_upload(lambda event: self._upload(take_upload(event)))
            self._build_simulation(gui)
            self._back = gui.add_button("Set sliders to the truth", color="gray", visible=False)
            self._back.on_click(lambda _: self._set_sliders())
            self._physics = self._physics_note()
            note = self._physics if self._scene else NO_SIMULATION if self._layout else NO_SIMULATOR
            self._note = gui.add_markdown(note, visible=bool(note))
        page.on_columns_changed(lambda: page.on_event_loop(self._refresh))
        self._refresh()

    def _build_simulation(self, gui: viser.GuiApi) -> None:
        self._start = gui.add_button(
            "Simulate this",
            disabled=self._scene is None,
            hint="run the simulator with the parameters of the sliders",
        )
        self._start.on_click(lambda _: self._simulate())
        self._bar = gui.add_progress_bar(0.0, visible=False)
        self._cancel = gui.add_button("Cancel", color="gray", visible=False)
        self._cancel.on_click(lambda _: self.close())

    def _physics_note(self) -> str:
        predictor = self._page.model.predictor
        trained = predictor.checkpoint.provenance.get("fixed", {}) if predictor else {}
        difference = physics_difference(trained, self._scene.fixed) if self._scene else ""
        return PHYSICS.format(difference) if difference else ""

    def describe(self, description: Description) -> None:
        self._back.visible = description.frame.off_truth

    def close(self) -> None:
        """Cancel the simulation in progress, if any."""
        with self._starting:
            if self._job is not None and self._job.running:
                self._job.cancel()
                self._show_working(False)

    def open(self, sequence: MotionSequence, origin: str = "") -> None:
        """Show a sequence as truth, and move the sliders to its parameters."""
        motion = RecordedMotion(self._schema, sequence)
        shown = with_own_colors(motion.geometry, self._page.model.predictor)
        self._columns.add(Column("truth", motion, shown, origin=origin))
        self._page.controls.set_parameters(sequence.parameters)
        self._page.columns_changed()

    def _upload(self, file: viser.UploadedFile) -> None:
        try:
            self.open(self._read(content_of(file), file.name))
        except InputError as error:
            self._page.notices.show("Motion not opened", str(error))

    def _read(self, content: bytes, name: str) -> MotionSequence:
        if self._layout is None:
            return read_captured(content, name, self._schema, self._page.body)
        return recorded_release(released(markers_in(content, name), self._layout), name)

    async def _chosen(self, event: viser.GuiEvent) -> None:
        # a coroutine runs at once where the message arrives, before `_refresh` shows the old choice again
        if event.client_id is not None:
            label = self._browser.value
            async with self._opening:
                await asyncio.to_thread(self._choose, label)

    def _choose(self, label: str) -> None:
        try:
            if label == NONE:
                self._remove()
            elif label in self._entries and self._dataset is not None:
                entry = self._entries[label]
                self.open(self._dataset.read(entry), self._origin(entry))
            elif label not in self._browser.options:
                raise InputError(f"test sequence: expected one of the list, got {label!r}")
        except InputError as error:
            self._page.notices.show("Sequence not opened", str(error))
        self._page.on_event_loop(self._refresh)

    def _origin(self, entry: Entry) -> str:
        return f"{self._schema.scene}/{entry.name}"

    def _remove(self) -> None:
        if (truth := self._columns.truth) is not None:
            self._columns.remove(truth.key)
        self._page.columns_changed()

    def _set_sliders(self) -> None:
        column = self._columns.truth
        if column is not None and column.truth is not None:
            self._page.controls.set_parameters(self._schema.known(column.truth.setting))
            self._page.wake()

    def _refresh(self) -> None:
        """Let the list name the visible truth, also one that is not from the list."""
        if self._dataset is None:
            return
        truth = self._columns.truth
        labels = {self._origin(entry): label for label, entry in self._entries.items()}
        label = NONE
        if truth is not None and truth.truth is not None:
            label = labels.get(truth.origin, truth.origin or truth.truth.sequence.name or SIMULATED)
        options = tuple(dict.fromkeys((NONE, label, *self._entries)))
        if label in self._entries:
            options = (NONE, *self._entries)
        if self._browser.value != label:
            # the value has to be an option at any time
            self._browser.options = tuple(dict.fromkeys((*self._browser.options, label)))
            self._browser.value = label
        if self._browser.options != options:
            self._browser.options = options

    def _simulate(self) -> None:
        try:
            parameters = self._schema.complete(self._page.controls.parameters())
            item = simulated_item(self._page.model.predictor, parameters)
        except InputError as error:
            self._page.notices.show("Simulation not started", str(error))
            return
        rate = OVERSAMPLING * self._schema.window.rate
        if item is None:
            work, arguments = simulate_motion, (self._schema.scene, parameters, rate)
        else:
            work, arguments = simulate_user_body, (self._schema.scene, item, parameters, rate)
        with self._starting:
            if self._job is not None and self._job.running:
                return
            self._show_working(True)
            self._job = Job(work, arguments, self._simulated, self._failed, self._progress)
            self._job.start()

    def _simulated(self, sequence: MotionSequence) -> None:
        try:
            self.open(sequence)
        except InputError as error:
            self._failed(str(error))
        else:
            self._show_working(False)  # only now: the sliders are at the truth when the next one can be started

    def _failed(self, message: str) -> None:
        self._show_working(False)
        self._show_note(f"⚠ **The simulation failed**: {message}")

    def _progress(self, fraction: float) -> None:
        self._bar.value = 100.0 * min(fraction, 1.0)

    def _show_note(self, note: str) -> None:
        self._note.content, self._note.visible = note, bool(note)

    def _show_working(self, working: bool) -> None:
        self._show_note(self._physics)
        self._bar.value = 0.0
        self._bar.visible = self._cancel.visible = working
        self._start.visible = not working
