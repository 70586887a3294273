"""How finely the ODE is integrated: by name, or as cheaply as a bound on time or error allows."""

import json
from collections.abc import Callable

import viser

from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.models.frontier import cheapest_within_error, finest_within_budget

__all__ = ["QualityPanel", "quality_names"]

WITHIN_MS, WITHIN_MM = "within a time", "within a solver error"
TRIALS = 5  # solves of which the quickest says what an evaluation costs here


def quality_names(predictor: Predictor) -> tuple[str, ...]:
    """What can be chosen: bounds only where the checkpoint knows what settings cost and how far they are off."""
    return (*predictor.qualities, *((WITHIN_MS, WITHIN_MM) if predictor.frontier else ()))


class QualityPanel:
    """A choice, with the bound it asks for."""

    def __init__(self, server: viser.ViserServer, predictor: Predictor, wake: Callable[[], None]) -> None:
        self._predictor, self._wake = predictor, wake
        self._names = quality_names(predictor)
        self._pace: float | None = None
        gui = server.gui
        self._choice = gui.add_dropdown(
            "quality", self._names, initial_value="balanced", hint="how finely the ODE is integrated"
        )
        self._budget = gui.add_number("at most (ms)", 5.0, min=0.1, max=1000.0, step=0.1, visible=False)
        self._bound = gui.add_number("at most (mm)", 0.1, min=1e-6, max=100.0, step=1e-6, visible=False)
        for control in (self._choice, self._budget, self._bound):
            control.on_update(lambda _: self._changed())

    def _changed(self) -> None:
        self._budget.visible = self._choice.value == WITHIN_MS
        self._bound.visible = self._choice.value == WITHIN_MM
        self._wake()

    def _ms_per_evaluation(self) -> float:
        """Measured once, so that a bound means the same setting however one came to it."""
        if self._pace is None:
            solved = [self._predictor.solve().stats for _ in range(TRIALS)]
            self._pace = min(s.wall_ms / s.evaluations for s in solved)
        return self._pace

    def request(self) -> str:
        """A name, or a setting of the frontier as JSON. `InputError` for what no hand could choose."""
        choice = self._choice.value
        if choice not in self._names:
            raise InputError(f"quality: expected one of {', '.join(self._names)}, got {choice!r}")
        if choice not in (WITHIN_MS, WITHIN_MM):
            return choice
        control = self._budget if choice == WITHIN_MS else self._bound
        if not 0.0 < control.value < float("inf"):
            raise InputError(f"quality: expected a positive bound, got {control.value}")
        frontier = self._predictor.frontier
        if choice == WITHIN_MS:
            point = finest_within_budget(frontier, control.value, self._ms_per_evaluation())
        else:
            point = cheapest_within_error(frontier, control.value)
        return json.dumps(point.quality.to_json())

    def set(self, request: str) -> None:
        """Choose what was once requested, as far as this predictor knows it."""
        if request in self._predictor.qualities:
            self._choice.value = request
        for point in self._predictor.frontier:
            if json.dumps(point.quality.to_json()) == request:
                self._choice.value, self._bound.value = WITHIN_MM, point.solver_error_mm
                self._changed()
