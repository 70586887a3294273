"""Shows a search for parameters as it goes: each step in a column of its own, and the estimates in words."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from odeform.errors import InputError
from odeform.identification.identify import Identification
from odeform.identification.pushed.experiment import Experiment
from odeform.identification.pushed.recorded import Recorded
from odeform.identification.pushed.state import BODY
from odeform.schema import OBJECT, Parameters, Schema
from odeform_viz.columns import Column
from odeform_viz.page import Page
from odeform_viz.words import parameter_title, plain

__all__ = ["CORRECTIONS", "FAILED", "Search", "body_of", "describe_identification"]

LABEL = "fit"
CORRECTIONS = 3  # simulations; more of them tell little
MADE = "From {} experiments together: {}."
FAILED = "⚠ **The fit failed**: {}"
FURTHER = "After the next {}, the widest interval of the body is expected to be {:.0%} as wide."
STOPPED = "⚠ **Corrected by {} of {} simulations**: the last estimate could not be simulated, {}."
NO_COLUMN = "⚠ **The motion found is not shown**: {}"
EXPLAINED = 1.0  # mean square difference, of the expected one, up to which model and noise explain an observation


def describe_identification(found: Identification, schema: Schema, truth: Parameters) -> str:
    """Markdown of estimates with their 90 % intervals, beside the true parameters where they are known."""
    titles = {p.name: f"{parameter_title(p)} ({p.unit})" if p.unit else parameter_title(p) for p in schema.parameters}
    rows = ["| | estimate | 90 % interval | truth |", "| --- | --- | --- | --- |"]
    for name, one in found.parameters.items():
        true = truth.get(name)
        estimate = f"**{_figure(one.value)}**" if one.identifiable else "not identifiable"
        known = "" if true is None else _figure(true)
        title = titles.get(name, name.replace("_", " "))
        rows.append(f"| {title} | {estimate} | {_figure(one.low)} to {_figure(one.high)} | {known} |")
    for parameter in (p for p in schema.parameters if p.role == "azimuth"):
        known = _figure(float(truth[parameter.name])) if parameter.name in truth else ""
        rows.append(f"| {titles[parameter.name]} | *as given* | | {known} |")
    explained = (
        "model and noise explain the motion"
        if found.misfit <= EXPLAINED
        else "⚠ **the model does not explain this motion**, and the intervals are wider for it"
    )
    apart = f"Mean square difference from the motion: {found.misfit:.2g} of what is expected"
    return "\n".join([*rows, "", f"{apart}; {explained}. The search took {found.seconds:.1f} s."])


def _figure(value: float) -> str:
    """Three digits, without an exponent where people need none: a chip's stiffness is 1570 kPa."""
    return f"{float(f'{value:.3g}'):g}"


def body_of(parameters: Parameters) -> dict[str, Any]:
    """Selects what belongs to the body, and not to what happens to it."""
    return {name: value for name, value in parameters.items() if name in (*BODY, OBJECT)}


@dataclass
class Search:
    """One search: shows each step in a column of its own."""

    page: Page
    model: Column
    truth: Parameters
    fixed: Parameters
    """Known parameters, which are not searched."""
    show: Callable[..., None]
    note: str = ""
    """Says what has to be known of the estimates."""
    experiments: list[Recorded] = field(default_factory=list)
    """All that are fitted, the newest last, where they are known."""
    misfits: list[str] = field(default_factory=list)
    last: str = ""
    """The last step in words, or the estimates."""
    estimate: Parameters = field(default_factory=dict)
    """For the sliders, once it is known."""
    key: int | None = None
    hidden: str = ""
    """Why there is no column for it; the search goes on without one."""

    def progress(self, report: float | str | tuple[dict[str, float], float] | Identification) -> None:
        """Show a step, how far a calibration is, what is simulated, or the estimates before the next experiment."""
        if isinstance(report, Identification):
            self._estimated(report)
            self.show(self.last, self.estimate, working=True)
            return
        if isinstance(report, str):
            self.show("\n\n".join(filter(None, (report, self.last))), self.estimate, working=True)
            return
        if not isinstance(report, tuple):
            self.show(f"Measuring the model's own error first: {100.0 * report:.0f} %", working=True)
            return
        parameters, misfit = report
        self.misfits.append(f"{misfit:.3g}")
        body = {name: value for name, value in parameters.items() if "_" not in name}  # places are shown
        values = plain(body, self.page.schema)
        steps = " → ".join(self.misfits[-6:])
        self.last = f"step {len(self.misfits)}: {values}  \ndifference, of what is expected: {steps}"
        self.show(self.last, working=True)
        self._place(parameters)

    def done(self, found: Identification) -> None:
        """Show the estimates, and the next experiment."""
        self._estimated(found)
        body = {name: value for name, value in self.fixed.items() if isinstance(value, str)}
        # what is made next is made with the body that is there
        proposed = Experiment(found.proposed_load, {**body, **found.proposed, **body_of(self.truth)})
        self.show(self.last, self.estimate, proposed=proposed)

    def _estimated(self, found: Identification) -> None:
        """Keep the estimates, and show their motion."""
        known = self.page.schema.names  # friction has no slider
        self.estimate = {**self.fixed, **{name: one.value for name, one in found.parameters.items() if name in known}}
        self._place(self.estimate)
        self.last = self._describe(found)
        self._remember()

    def _describe(self, found: Identification) -> str:
        """Markdown of the estimates, and of what has to be known of them."""
        text = describe_identification(found, self.page.schema, self.truth)
        made = [one.made.experiment.load for one in self.experiments]
        together = MADE.format(len(made), ", ".join(made)) if len(made) > 1 else ""
        stopped = STOPPED.format(found.simulations, CORRECTIONS, found.stopped) if found.stopped else ""
        further = FURTHER.format(found.proposed_load, found.narrowed) if found.proposed_load else ""
        return "\n\n".join(filter(None, (text, together, stopped, further, self.note, self.hidden)))

    def _remember(self) -> None:
        """Keep the newest experiment for fits to come, once."""
        for now in self.experiments[-1:]:
            given = now.made.experiment.parameters
            others = [one for one in self.page.experiments if one.made.experiment.parameters != given]
            self.page.experiments[:] = [*others, now]

    def failed(self, message: str) -> None:
        """Say why there are none."""
        self.show(FAILED.format(message))

    def _place(self, parameters: Parameters) -> None:
        """Show a step in the column of this search, else in that of an earlier one, else in a new one."""
        columns, names = self.page.columns, self.page.schema.names
        parameters = {name: value for name, value in parameters.items() if name in names}
        column = replace(self.model, label=LABEL, pinned={**self.fixed, **parameters}, visible=True, fitted=True)
        mine = [c for c in columns.all if c.key == self.key] or [c for c in columns.all if c.label == LABEL]
        if mine:
            self.key = mine[0].key
            columns.change(lambda all_: [_moved(c, column) if c.key == self.key else c for c in all_])
        else:
            try:
                columns.add(column)
            except InputError as error:  # too many
                self.hidden = NO_COLUMN.format(error)
                return
            self.hidden = ""
            self.key = next(c.key for c in reversed(columns.all) if c.pinned == column.pinned)
        self.page.columns_changed()


def _moved(known: Column, column: Column) -> Column:
    return replace(column, label=known.label, key=known.key, color_index=known.color_index)
