"""Fits the parameters of the model to the visible truth, step by step before the user's eyes."""

import math
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.identification.identify import Identification
from odeform.identification.known import why_not_identifiable
from odeform.identification.observation import View, observe
from odeform.identification.pushed.experiment import Experiment
from odeform.identification.pushed.forward import pushed_model
from odeform.identification.pushed.identify import identifies_pushes
from odeform.identification.pushed.recorded import Recorded, recorded_experiment, recorded_points
from odeform.identification.pushed.simulator import can_simulate
from odeform.identification.pushed.state import BODY
from odeform.loads.measured import FALLS
from odeform.loads.registry import PUSH, load_of_scene
from odeform.models.base import Predictor
from odeform.motion.recorded import RecordedMotion
from odeform.schema import OBJECT, Parameters
from odeform_viz.columns import Column
from odeform_viz.page import Page, Panel
from odeform_viz.panels.fit_search import CORRECTIONS, FAILED, Search, body_of
from odeform_viz.runtime.jobs import Job, fit_body, fit_parameters, fit_push

__all__ = ["FitPanel"]

NEXT = "Set sliders to the next {}"
NEXT_HINT = (
    "what would tell most of what is least known of the body; a drop or a throw changes what happens (Explore leads "
    "back to the push). Simulate or open its motion there, and fit it together with this one"
)
TOGETHER = "with earlier experiments"
TOGETHER_HINT = "fit one body to all its pushes, drops and throws that are known and were fitted since the page opened"
NO_TRUTH = "Choose, open or simulate a motion above; this finds the parameters that reproduce it."
SHORT = "⚠ **Intervals were calibrated on motions of {:g} s**; this one ends at {:.3g} s, and they may be too narrow."
CALIBRATED = "Intervals are as wide as simulated bodies took for nine in ten to lie within."
PUSH_OPEN = (
    "⚠ **Intervals were calibrated on pushes that are known**: this one is estimated, and they may be too narrow."
)
FALLEN = (
    "⚠ **Intervals were calibrated on single pushes**: of several experiments, and of drops and throws, they may be "
    "too narrow, above all those of friction."
)
ALONE = "the model"
CORRECTED = f"model + {CORRECTIONS} simulations"
HOW = (
    "what the model misses looks like another body; simulations of the estimate say what it misses, and take some ten "
    "seconds each. With falls beside pushes, 3 are of the pushes alone, and 3 of all"
)
KNOWN = "the push is known"
KNOWN_HINT = (
    "give the fit the contact and the force of the visible truth; mass, stiffness and friction are then found better"
)
NOTHING = Experiment("", {})
ROUNDED = 0.01  # of masses and stiffnesses, by sliders


class FitPanel(Panel):
    """A button, the steps of the search as a column of their own, and the estimates.

    The search runs in a process of its own: sliders stay as quick as without it.
    """

    def __init__(self, page: Page) -> None:
        self._page, self._columns = page, page.columns
        self._lock = threading.Lock()
        self._job: Job | None = None
        self._search: Search | None = None
        self._truth: RecordedMotion | None = None
        self._found: Parameters = {}
        self._proposed = NOTHING
        gui = page.server.gui
        with gui.add_folder("Fit"):
            self._text = gui.add_markdown(NO_TRUTH)
            self._how = gui.add_dropdown("by", [ALONE, CORRECTED], hint=HOW) if _corrects(page) else None
            pushes = _mechanical(page) is not None and _load(page) == PUSH
            self._known = gui.add_checkbox(KNOWN, False, hint=KNOWN_HINT) if pushes else None
            self._together = gui.add_checkbox(TOGETHER, True, hint=TOGETHER_HINT, visible=False)
            self._start = gui.add_button(
                "Fit to the truth", hint="find the parameters that reproduce the visible truth"
            )
            self._start.on_click(lambda _: self._begin())
            self._cancel = gui.add_button("Cancel the fit", color="gray", visible=False)
            self._cancel.on_click(lambda _: self.close())
            self._use = gui.add_button("Set sliders to the estimate", color="gray", visible=False)
            self._use.on_click(lambda _: self._use_estimate())
            self._next = gui.add_button(NEXT.format(PUSH), color="gray", visible=False, hint=NEXT_HINT)
            self._next.on_click(lambda _: self._use_proposed())
        page.on_columns_changed(lambda: page.on_event_loop(self._refresh))
        self._refresh()

    @classmethod
    def needed(cls, page: Page) -> bool:
        predictor = page.model.predictor
        return predictor is not None and (_mechanical(page) is not None or not why_not_identifiable(predictor))

    def close(self) -> None:
        """Cancel the search in progress, if any; estimates that it has told stay."""
        with self._lock:
            if self._job is not None and self._job.running:
                self._job.cancel()
                self._show(*self._known_so_far())

    def _known_so_far(self) -> tuple[str, Parameters]:
        """The estimates of the search, if there are any yet."""
        search = self._search
        return (search.last, search.estimate) if search is not None and search.estimate else ("", {})

    def _refresh(self) -> None:
        """Follow the visible truth: another one has no estimate yet."""
        column = self._columns.truth
        truth = column.truth if column is not None and column.visible else None
        self._start.disabled = truth is None
        if truth is not self._truth:
            self._truth = truth
            self.close()
            self._show("" if truth else NO_TRUTH)
            self._together.visible = bool(self._before())

    def _show(
        self, text: str, found: Parameters | None = None, working: bool = False, proposed: Experiment = NOTHING
    ) -> None:
        self._text.content, self._text.visible = text, bool(text)
        self._found = found or {}
        self._proposed = proposed
        self._next.label = NEXT.format(proposed.load or PUSH)
        self._use.visible, self._next.visible = bool(found), bool(proposed.load)
        self._start.visible, self._cancel.visible = not working, working

    def _begin(self) -> None:
        with self._lock:
            truth, model = self._truth, self._page.model
            if truth is None or model.predictor is None or (self._job is not None and self._job.running):
                return
            schema, predictor = self._page.schema, model.predictor
            if (mechanical := _mechanical(self._page)) is not None:
                self._begin_body(mechanical, truth, model)
                return
            try:
                # an azimuth that is not known is the sliders'
                known = {**self._page.controls.parameters(), **truth.setting}
                fixed = {p.name: known[p.name] for p in schema.parameters if p.role == "azimuth"}
                observation = observe(replace(truth.sequence, parameters=known), schema, View())
            except InputError as error:
                self._show(FAILED.format(error))
                return
            window = schema.window
            ends = float(observation.times[-1])
            note = SHORT.format(window.stop, ends) if ends < window.stop - 1.0 / window.rate else ""
            search = Search(self._page, model, truth.setting, fixed, self._show, note)
            self._page.controls.set_overlay(True)
            self._run(search, fit_parameters, (type(predictor), predictor.checkpoint, observation))

    def _begin_body(self, predictor: Predictor, truth: RecordedMotion, model: Column) -> None:
        """Searches the body of a recorded motion, and the push if it is not known."""
        load, true = _load(self._page), _true(predictor, truth)
        named = {name: value for name, value in truth.setting.items() if isinstance(value, str)}
        corrects = self._how is not None and self._how.value == CORRECTED
        simulations = CORRECTIONS if corrects else 0
        try:
            if self._known is not None and not self._known.value:
                seen = recorded_points(predictor, truth.sequence, named)
                note = PUSH_OPEN if corrects else CALIBRATED
                search = Search(self._page, model, true, named, self._show, note)
                work, arguments = fit_push, (predictor, seen, named, simulations)
            else:
                now = recorded_experiment(predictor, load, truth.sequence, true)
                before = self._before() if self._together.value else []
                fixed = {key: value for key, value in truth.setting.items() if key not in BODY}
                every = [*before, now]
                note = CALIBRATED if len(every) == 1 and load == PUSH else FALLEN
                search = Search(self._page, model, true, fixed, self._show, note, every)
                work, arguments = fit_body, (predictor, search.experiments, named, simulations)
        except InputError as error:
            self._show(FAILED.format(error))
            return
        self._run(search, work, arguments)

    def _run(self, search: Search, work: Callable[..., Identification], arguments: tuple[Any, ...]) -> None:
        self._search = search
        self._show("starting", working=True)
        self._job = Job(work, arguments, search.done, search.failed, search.progress)
        self._job.start()

    def _before(self) -> list[Recorded]:
        """Experiments that were fitted before with the body of the visible truth."""
        truth, predictor = self._truth, _mechanical(self._page)
        if truth is None or predictor is None:
            return []
        true = _true(predictor, truth)
        found = [one for one in self._page.experiments if np.array_equal(one.faces, truth.sequence.faces)]
        found = [one for one in found if one.made.experiment.parameters != true]
        return [one for one in found if _same_body(one.made.experiment.parameters, true)]

    def _use_proposed(self) -> None:
        """Set the sliders, on this page or on that of another load."""
        load, parameters = self._proposed.load, self._proposed.parameters
        if load != PUSH:
            try:
                self._page.controls.show_load(load, parameters)
            except InputError as error:
                self._page.notices.show("Nothing changed", str(error))
            return
        self._page.controls.set_parameters(parameters)
        self._page.wake()

    def _use_estimate(self) -> None:
        self._page.controls.set_parameters(self._found)
        self._page.wake()


def _load(page: Page) -> str:
    load = load_of_scene(page.schema.scene)
    return PUSH if load is None else load.name


def _mechanical(page: Page) -> Predictor | None:
    """The page's model of pushed bodies, if pushes or falls of them can be fitted."""
    predictor, load = page.model.predictor, _load(page)
    if predictor is None or load not in (PUSH, *FALLS):
        return None
    root = predictor if load == PUSH else predictor.under(PUSH)
    return root if identifies_pushes(root) else None


def _corrects(page: Page) -> bool:
    """Whether simulations can correct the model."""
    predictor = _mechanical(page)
    return predictor is not None and can_simulate(predictor)


def _true(predictor: Predictor, truth: RecordedMotion) -> dict[str, Any]:
    """What is known of a truth. Motions of the scene that name no mass and no stiffness are of the object as it is."""
    model = pushed_model(predictor, truth.setting)
    own = {} if model is None or truth.unknown else model.own_values
    return {**own, **truth.setting}


def _same_body(one: Parameters, other: Parameters) -> bool:
    """Whether what is known of two bodies is the same, to what a slider rounds."""
    first, second = body_of(one), body_of(other)
    numbers = [name for name, value in first.items() if not isinstance(value, str)]
    return (
        first.keys() == second.keys()
        and first.get(OBJECT) == second.get(OBJECT)
        and all(math.isclose(first[name], second[name], rel_tol=ROUNDED) for name in numbers)
    )
