"""The accuracy of the ODE solver: by name, or the cheapest settings within a budget of time or error."""

import json

from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.models.frontier import FrontierPoint, cheapest_within_error, finest_within_budget
from odeform_viz.browser.limits import set_limits
from odeform_viz.page import Page, Panel
from odeform_viz.panels.callbacks import set_content
from odeform_viz.state import PageState

__all__ = ["QualityPanel", "quality_names"]

TIME_BUDGET, ERROR_BUDGET = "time budget", "error budget"
LIMITS = {TIME_BUDGET: (0.1, 1000.0), ERROR_BUDGET: (1e-6, 100.0)}  # ms, mm
MEASURED = "The chosen steps take {:.1f} ms on this machine, as measured when the budget was chosen."
TRIALS = 5  # solves; the fastest gives the time of one evaluation on this machine


def quality_names(predictor: Predictor) -> tuple[str, ...]:
    """The choices: budgets only where the checkpoint has measured settings."""
    return (*predictor.qualities, *((TIME_BUDGET, ERROR_BUDGET) if predictor.frontier else ()))


def _integrated(page: Page) -> Predictor | None:
    """The first model that solves an ODE."""
    return next((c.predictor for c in page.columns.all if c.predictor and c.predictor.qualities), None)


class QualityPanel(Panel):
    """A dropdown, and the budget of the chosen kind."""

    @classmethod
    def needed(cls, page: Page) -> bool:
        return _integrated(page) is not None

    def __init__(self, page: Page) -> None:
        predictor = _integrated(page)
        assert predictor is not None
        self._predictor, self._page, self._wake = predictor, page, page.wake
        self._names = quality_names(predictor)
        self._ms_per_evaluation: float | None = None
        self._chosen = "balanced"
        gui = page.server.gui
        self._choice = gui.add_dropdown(
            "quality", self._names, initial_value="balanced", hint="accuracy of the ODE solver"
        )
        self._budget_ms = gui.add_number("at most (ms)", 5.0, step=0.1, visible=False)
        self._budget_mm = gui.add_number("at most (mm)", 0.1, step=1e-6, visible=False)
        self._measured = gui.add_markdown("", visible=False)
        set_limits(page.server, self._budget_ms, *LIMITS[TIME_BUDGET])
        set_limits(page.server, self._budget_mm, *LIMITS[ERROR_BUDGET])
        for control in (self._choice, self._budget_ms, self._budget_mm):
            control.on_update(lambda _: self._changed())
        page.controls.quality = self.quality

    def quality(self) -> str:
        """A name, or the settings within the budget as JSON. `InputError` for values no control can have."""
        choice = self._choice.value
        if choice not in self._names:
            raise InputError(f"quality: expected one of {', '.join(self._names)}, got {choice!r}")
        if choice not in (TIME_BUDGET, ERROR_BUDGET):
            return choice
        budget = (self._budget_ms if choice == TIME_BUDGET else self._budget_mm).value
        low, high = LIMITS[choice]
        if not low <= budget <= high:
            raise InputError(f"quality: expected a budget from {low:g} to {high:g}, got {budget:g}")
        if choice == TIME_BUDGET:
            point = finest_within_budget(self._frontier, budget, self._measured_pace())
            set_content(self._measured, MEASURED.format(point.evaluations * self._measured_pace()))
        else:
            point = cheapest_within_error(self._frontier, budget)
        return json.dumps(point.quality.to_json())

    def set(self, quality: str) -> None:
        """Choose what `quality` once returned; nothing changes if this predictor does not have it."""
        if quality in self._predictor.qualities:
            self._choice.value = quality
        for point in self._frontier:
            if json.dumps(point.quality.to_json()) == quality:
                self._choice.value, self._budget_mm.value = ERROR_BUDGET, point.solver_error_mm
                self._changed()

    def restore(self, state: PageState) -> None:
        self.set(state.quality)

    @property
    def _frontier(self) -> tuple[FrontierPoint, ...]:
        """Returns the frontier of the body that the parameters select."""
        return self._predictor.frontier_of(self._predictor.complete(self._page.controls.parameters()))

    def _changed(self) -> None:
        self._budget_ms.visible = self._measured.visible = self._choice.value == TIME_BUDGET
        if self._choice.value != self._chosen:
            # measured anew each time that it is chosen, as others may be using the machine
            self._chosen, self._ms_per_evaluation = self._choice.value, None
        self._budget_mm.visible = self._choice.value == ERROR_BUDGET
        self._wake()

    def _measured_pace(self) -> float:
        """Milliseconds per evaluation on this machine; measured once while the choice lasts, so that a budget means the
        same settings all the time."""
        if self._ms_per_evaluation is None:
            solved = [self._predictor.solve().stats for _ in range(TRIALS)]
            self._ms_per_evaluation = min(s.wall_ms / s.evaluations for s in solved)
        return self._ms_per_evaluation
