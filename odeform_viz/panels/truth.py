"""The truth of a setting: a sequence of a data set, or one simulated on the spot."""

from collections.abc import Callable, Mapping

import viser

from odeform.dataset.index import Dataset, Entry
from odeform.errors import InputError
from odeform.model.recorded import RecordedMotion
from odeform.schema import Schema
from odeform.types import Sequence
from odeform_viz.columns import Column, Columns
from odeform_viz.jobs import Job, simulate_here, simulator_installed

__all__ = ["TruthPanel", "entry_label"]

NONE = "none"
FINER = 4  # times the frames of training: one looks between them


def entry_label(entry: Entry, schema: Schema) -> str:
    """A sequence by its number and what was varied."""
    values = ", ".join(f"{p.name} {entry.parameters[p.name]:.3g}" for p in schema.learned)
    return f"{entry.name.rsplit('_', 1)[-1].lstrip('0') or '0'}: {values}"


class TruthPanel:
    """A browser of the test sequences at hand, and the simulator in a process of its own."""

    def __init__(
        self,
        server: viser.ViserServer,
        schema: Schema,
        columns: Columns,
        dataset: Dataset | None,
        parameters: Callable[[], dict[str, float]],
        set_parameters: Callable[[Mapping[str, float]], None],
        changed: Callable[[], None],
        say: Callable[[str], None],
    ) -> None:
        """`set_parameters` moves the sliders; `changed` is called after the columns have; `say` shows a message."""
        self._schema, self._columns, self._dataset = schema, columns, dataset
        self._parameters, self._set, self._changed, self._say = parameters, set_parameters, changed, say
        self._job: Job | None = None
        gui = server.gui
        with gui.add_folder("Truth"):
            if dataset is not None:
                self._entries = {entry_label(e, schema): e for e in dataset.select("test")}
                self._browser = gui.add_dropdown("test sequence", (NONE, *self._entries))
                self._browser.on_update(lambda event: self._opened(event.client_id is not None))
            self._start = gui.add_button(
                "Simulate this",
                disabled=not simulator_installed(),
                hint="runs the simulator at the sliders' values"
                if simulator_installed()
                else "needs the simulator: pip install 'odeform[simulate]'",
            )
            self._start.on_click(lambda _: self._simulate())
            self._bar = gui.add_progress_bar(0.0, visible=False)
            self._cancel = gui.add_button("Cancel", color="gray", visible=False)
            self._cancel.on_click(lambda _: self.cancel())
            self._back = gui.add_button("Sliders to the truth's parameters", color="gray", visible=False)
            self._back.on_click(lambda _: self._return())

    def open(self, sequence: Sequence, origin: str = "") -> None:
        """Show a sequence as truth, and move the sliders to its parameters."""
        motion = RecordedMotion(self._schema, sequence)
        self._columns.add(Column("truth", motion, motion.geometry, origin=origin))
        self._set(sequence.parameters)
        self._changed()

    def _opened(self, by_hand: bool) -> None:
        if not by_hand:
            return
        chosen = self._browser.value
        try:
            if chosen == NONE:
                self._drop()
            elif chosen in self._entries and self._dataset is not None:
                entry = self._entries[chosen]
                self.open(self._dataset.read(entry), f"{self._schema.scene}/{entry.name}")
            else:
                raise InputError(f"test sequence: expected one of the list, got {chosen!r}")
        except InputError as error:
            self._say(str(error))

    def _drop(self) -> None:
        for column in self._columns.all:
            if column.truth:
                self._columns.remove(column.key)
        self._changed()

    def _return(self) -> None:
        truth = next((c.truth for c in self._columns.all if c.truth), None)
        if truth is not None:
            self._set(truth.parameters)
            self._changed()

    def show(self, away: bool) -> None:
        """`away`: there is a truth, but the sliders have left its parameters."""
        self._back.visible = away

    def _simulate(self) -> None:
        if self._job is not None and self._job.running:
            return
        try:
            parameters = self._schema.complete(self._parameters())
        except InputError as error:
            self._say(str(error))
            return
        rate = FINER * self._schema.window.rate

        def done(sequence: Sequence) -> None:
            self._working(False)
            self.open(sequence)

        def failed(message: str) -> None:
            self._working(False)
            self._say(f"the simulation failed: {message}")

        def progress(share: float) -> None:
            self._bar.value = 100.0 * min(share, 1.0)

        self._working(True)
        arguments = (self._schema.scene, parameters, rate)
        self._job = Job(simulate_here, arguments, done=done, failed=failed, progress=progress)
        self._job.start()

    def _working(self, working: bool) -> None:
        self._bar.value = 0.0
        self._bar.visible = self._cancel.visible = working
        self._start.visible = not working

    def cancel(self) -> None:
        """End the simulation under way, if any."""
        if self._job is not None and self._job.running:
            self._job.cancel()
            self._working(False)
