"""The truth of a setting: a sequence of a data set, or one simulated on the spot."""

import asyncio
import threading
from collections.abc import Callable, Mapping

import viser

from odeform.dataset.index import Dataset, Entry
from odeform.errors import InputError
from odeform.motion.recorded import RecordedMotion
from odeform.schema import Schema
from odeform.simulation.scenes.registry import find_scene
from odeform.types import MotionSequence
from odeform_viz.columns import Column, Columns
from odeform_viz.runtime.jobs import Job, simulate_motion

__all__ = ["TruthPanel", "entry_label", "other_physics"]

NONE = "none"
OTHER = "another"  # simulated here, or of another data set
NO_SIMULATOR = "This scene was imported: there is no simulator of it here."
FINER = 4  # times the frames of training: one looks between them

PHYSICS = (
    "⚠ **The simulator's physics are not those the model was taught**: errors against what is simulated here are not "
    "the model's alone. {}."
)


def entry_label(entry: Entry, schema: Schema) -> str:
    """A sequence by its number and what was varied."""
    values = ", ".join(f"{p.name} {entry.parameters[p.name]:.3g}" for p in schema.learned)
    return f"{entry.name.rsplit('_', 1)[-1].lstrip('0') or '0'}: {values}"


def other_physics(taught: Mapping[str, float], simulated: Mapping[str, float]) -> str:
    """What of the physics that a scene leaves fixed differs from what a model was taught, in words; empty if none."""
    names = [name for name in {**taught, **simulated} if taught.get(name) != simulated.get(name)]

    def value(physics: Mapping[str, float], name: str) -> str:
        return f"{physics[name]:.4g}" if name in physics else "none"

    return ", ".join(f"{name} {value(simulated, name)} (taught {value(taught, name)})" for name in names)


class TruthPanel:
    """A browser of the test sequences at hand, and the simulator in a process of its own."""

    def __init__(
        self,
        server: viser.ViserServer,
        schema: Schema,
        columns: Columns,
        dataset: Dataset | None,
        taught: Mapping[str, float],
        parameters: Callable[[], dict[str, float]],
        set_parameters: Callable[[Mapping[str, float]], None],
        changed: Callable[[], None],
        say: Callable[[str], None],
    ) -> None:
        """`taught` is the fixed physics that the model learned; `set_parameters` moves the sliders; `changed` is
        called after the columns have; `say` shows a message.
        """
        self._schema, self._columns, self._dataset = schema, columns, dataset
        self._parameters, self._set, self._changed, self._say = parameters, set_parameters, changed, say
        self._job: Job | None = None
        self._starting = threading.Lock()
        self._opening = asyncio.Lock()  # fair: what was chosen last is opened last
        scene = find_scene(schema.scene)
        gui = server.gui
        with gui.add_folder("Truth"):
            if dataset is not None:
                self._entries = {entry_label(e, schema): e for e in dataset.select("test")}
                self._browser = gui.add_dropdown("test sequence", (NONE, OTHER, *self._entries))
                self._browser.on_update(self._opened)
            self._start = gui.add_button(
                "Simulate this",
                disabled=scene is None,
                hint="runs the simulator at the sliders' values",
            )
            self._start.on_click(lambda _: self._simulate())
            self._bar = gui.add_progress_bar(0.0, visible=False)
            self._cancel = gui.add_button("Cancel", color="gray", visible=False)
            self._cancel.on_click(lambda _: self.cancel())
            self._back = gui.add_button("Sliders to the truth's parameters", color="gray", visible=False)
            self._back.on_click(lambda _: self._return())
            differs = other_physics(taught, scene.fixed) if scene else ""
            self._physics = PHYSICS.format(differs) if differs else ""
            note = NO_SIMULATOR if scene is None else self._physics
            self._note = gui.add_markdown(note, visible=bool(note))
        self.refresh()

    def open(self, sequence: MotionSequence, origin: str = "") -> None:
        """Show a sequence as truth, and move the sliders to its parameters."""
        motion = RecordedMotion(self._schema, sequence)
        self._columns.add(Column("truth", motion, motion.geometry, origin=origin))
        self._set(sequence.parameters)
        self._changed()

    def _origin(self, entry: Entry) -> str:
        return f"{self._schema.scene}/{entry.name}"

    async def _opened(self, event: viser.GuiEvent) -> None:
        # a coroutine reads the request at once where the message came in, before `refresh` says what is still shown
        if event.client_id is not None:
            chosen = self._browser.value
            async with self._opening:
                await asyncio.to_thread(self._choose, chosen)

    def _choose(self, chosen: str) -> None:
        try:
            if chosen == NONE:
                self._drop()
            elif chosen in self._entries and self._dataset is not None:
                entry = self._entries[chosen]
                self.open(self._dataset.read(entry), self._origin(entry))
            elif chosen != OTHER:
                raise InputError(f"test sequence: expected one of the list, got {chosen!r}")
        except InputError as error:
            self._say(str(error))
        self.refresh()

    def _drop(self) -> None:
        for column in self._columns.all:
            if column.truth:
                self._columns.remove(column.key)
        self._changed()

    def _return(self) -> None:
        truth = next((c.truth for c in self._columns.all if c.truth), None)
        if truth is not None:
            self._set(self._schema.known(truth.setting))
            self._changed()

    def refresh(self) -> None:
        """Let the browser name the truth that is shown, wherever it came from."""
        if self._dataset is None:
            return
        truth = next((c for c in self._columns.all if c.truth), None)
        labels = {self._origin(entry): label for label, entry in self._entries.items()}
        shown = NONE if truth is None else labels.get(truth.origin, OTHER)
        if self._browser.value != shown:
            self._browser.value = shown

    def show(self, away: bool) -> None:
        """`away`: there is a truth, but the sliders have left its parameters."""
        self._back.visible = away

    def _simulate(self) -> None:
        try:
            parameters = self._schema.complete(self._parameters())
        except InputError as error:
            self._say(str(error))
            return
        arguments = (self._schema.scene, parameters, FINER * self._schema.window.rate)
        with self._starting:
            if self._job is not None and self._job.running:
                return
            self._working(True)
            self._job = Job(simulate_motion, arguments, self._simulated, self._failed, self._progress)
            self._job.start()

    def _simulated(self, sequence: MotionSequence) -> None:
        self._working(False)
        try:
            self.open(sequence)
        except InputError as error:
            self._failed(str(error))

    def _failed(self, message: str) -> None:
        self._working(False)
        self._tell(f"⚠ **The simulation failed**: {message}")

    def _progress(self, share: float) -> None:
        self._bar.value = 100.0 * min(share, 1.0)

    def _tell(self, note: str) -> None:
        self._note.content, self._note.visible = note, bool(note)

    def _working(self, working: bool) -> None:
        self._tell(self._physics)
        self._bar.value = 0.0
        self._bar.visible = self._cancel.visible = working
        self._start.visible = not working

    def cancel(self) -> None:
        """End the simulation under way, if any."""
        with self._starting:
            if self._job is not None and self._job.running:
                self._job.cancel()
                self._working(False)
