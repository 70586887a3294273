"""What an integration gives: a state at any time, and how it came about."""

from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np

from odeform.types import Floats

__all__ = ["Solution", "Status"]


class Status(Enum):
    """How an integration ended. Everything but OK ends it early; the part up to there stands."""

    OK = "ok"
    MAX_STEPS = "step limit reached"
    UNDERFLOW = "step size underflow"
    NON_FINITE = "non-finite state"


@dataclass
class Solution:
    """A trajectory known at the nodes of its steps and between them.

    States may be numpy arrays or torch tensors of any shape. `slopes[i]` is the field at node i; `middles[i]` the
    state half-way through step i for methods with a quartic interpolant. Grows at its end only (see `integrate`),
    so what it says of a time never changes.
    """

    times: list[float]
    states: list[Any]
    slopes: list[Any]
    middles: list[Any] = field(default_factory=list)
    evaluations: int = 0
    rejected: int = 0
    status: Status = Status.OK
    next_step: float = 0.0

    @property
    def steps(self) -> int:
        return len(self.times) - 1

    @property
    def end(self) -> float:
        return self.times[-1]

    def at(self, time: float) -> Any:
        """The state at `time`, clamped to the integrated span. Cubic Hermite, quartic where middles are known."""
        if self.steps == 0:
            return self.states[0]
        index = int(np.searchsorted(self.times, time, side="right")) - 1
        index = min(max(index, 0), self.steps - 1)
        step = self.times[index + 1] - self.times[index]
        s = min(max((time - self.times[index]) / step, 0.0), 1.0)
        y0, y1 = self.states[index], self.states[index + 1]
        f0, f1 = self.slopes[index], self.slopes[index + 1]
        rest = 1.0 - s
        cubic = (
            ((1.0 + 2.0 * s) * rest * rest) * y0
            + (s * s * (3.0 - 2.0 * s)) * y1
            + (s * rest * rest * step) * f0
            - (s * s * rest * step) * f1
        )
        if not self.middles:
            return cubic
        # the quartic bubble lifts the cubic to the known state at half the step
        cubic_middle = 0.5 * (y0 + y1) + (step / 8.0) * (f0 - f1)
        return cubic + (16.0 * s * s * rest * rest) * (self.middles[index] - cubic_middle)

    def sample(self, times: Floats) -> Any:
        """(T, ...) states at `times`, numpy states only."""
        return np.stack([self.at(float(time)) for time in times])
