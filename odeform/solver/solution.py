"""The result of an integration: the state at any time, a status and statistics."""

from bisect import bisect_right
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np

from odeform.locks import Lock
from odeform.types import Floats, Ints

__all__ = ["Solution", "Status", "between", "hermite_weights"]


class Status(Enum):
    """How an integration ended. Anything but OK ended it early; the solution up to there is valid."""

    OK = "ok"
    MAX_STEPS = "step limit reached"
    UNDERFLOW = "step size underflow"
    NON_FINITE = "non-finite state"


@dataclass
class Solution:
    """A trajectory, evaluated at the nodes of its steps and interpolated between them.

    `times[i]` in seconds, `states[i]` (n,) and `slopes[i]` (n,), the field, belong to node i; `middles[i]` (n,) is the
    state halfway through step i, for methods with a quartic interpolant. It grows at its end only (see `integrate`), so
    its state at a time never changes. Threads may share it: `integrate` holds `lock` while it grows.
    """

    times: list[float]
    states: list[Any]
    slopes: list[Any]
    middles: list[Any] = field(default_factory=list)
    evaluations: int = 0
    rejected: int = 0
    status: Status = Status.OK
    next_step: float = 0.0
    last_ratio: float = 1.0
    """Estimated error of the last step divided by the tolerance, where steps are controlled."""
    lock: Lock = field(default_factory=Lock, init=False, repr=False, compare=False)

    def __getstate__(self) -> dict[str, Any]:
        with self.lock:
            # lists as they are now: another thread may go on before they are written
            return {name: value[:] if isinstance(value, list) else value for name, value in vars(self).items()}

    def append(self, time: float, state: Any, slope: Any, middle: Any | None = None) -> None:
        """Add a node at `time` in seconds, with its `state` (n,), `slope` (n,), and the `middle` (n,) of the step."""
        self.states.append(state)
        self.slopes.append(slope)
        if middle is not None:
            self.middles.append(middle)
        self.times.append(time)  # last: what other threads read of the solution is then complete

    @property
    def steps(self) -> int:
        """Number of accepted steps."""
        return len(self.times) - 1

    @property
    def end(self) -> float:
        """Time of the last node in seconds."""
        return self.times[-1]

    def at(self, time: float) -> Any:
        """Computes the state (n,) at `time` in seconds, clamped to the integrated span. Cubic Hermite, or quartic with
        middles."""
        last = self.steps - 1  # once: the solution may be growing
        if last < 0:
            return self.states[0]
        index = bisect_right(self.times, time) - 1
        index = min(max(index, 0), last)
        step = self.times[index + 1] - self.times[index]
        s = min(max((time - self.times[index]) / step, 0.0), 1.0)
        middle = self.middles[index] if self.middles else None
        weights = hermite_weights(s, step)
        y0, y1 = self.states[index : index + 2]
        f0, f1 = self.slopes[index : index + 2]
        return between(weights, y0, y1, f0, f1, middle)

    def sample(self, times: Floats) -> Any:
        """Samples states (T, n) at `times` (T,) s, bit-identical to `at`."""
        if self.steps == 0 or len(times) == 1:
            return np.stack([self.at(float(time)) for time in times])
        nodes = np.asarray(self.times)
        index = np.clip(np.searchsorted(nodes, times, side="right") - 1, 0, len(nodes) - 2)
        step = nodes[index + 1] - nodes[index]
        s = np.clip((times - nodes[index]) / step, 0.0, 1.0)
        y0, y1, f0, f1 = (_rows(rows, at) for rows in (self.states, self.slopes) for at in (index, index + 1))
        middle = _rows(self.middles, index) if self.middles else None
        like = (len(times), *(1,) * (y0.ndim - 1))
        weights = [weight.astype(y0.dtype).reshape(like) for weight in hermite_weights(s, step)]
        return between(weights, y0, y1, f0, f1, middle)


def _rows(rows: list[Any], at: Ints) -> Any:
    """Some of the rows as one array: joined flat, which takes a quarter of the time of stacking them."""
    return np.concatenate([rows[i] for i in at.tolist()]).reshape(len(at), *rows[0].shape)


def hermite_weights(s: Any, step: Any) -> list[Any]:
    """Cubic weights of both states and slopes at the fraction `s` of a step, `step` / 8, and the quartic bubble."""
    rest = 1.0 - s
    return [
        (1.0 + 2.0 * s) * rest * rest,
        s * s * (3.0 - 2.0 * s),
        s * rest * rest * step,
        s * s * rest * step,
        step / 8.0,
        16.0 * s * s * rest * rest,
    ]


def between(weights: list[Any], y0: Any, y1: Any, f0: Any, f1: Any, middle: Any | None) -> Any:
    """The state within a step, by `hermite_weights`, from states and slopes at both ends: cubic, or quartic with the
    state in the `middle`. States (n,), or arrays that broadcast."""
    w0, w1, v0, v1, eighth, bubble = weights
    cubic = w0 * y0 + w1 * y1 + v0 * f0 - v1 * f1
    if middle is None:
        return cubic
    # the bubble moves the cubic to the known state at half the step
    cubic_middle = 0.5 * (y0 + y1) + eighth * (f0 - f1)
    return cubic + bubble * (middle - cubic_middle)
