"""Checks a motion: where it leaves what is physically possible, the last valid moment is shown instead.

Within the trained window a model predicts each moment by itself, so each is checked by itself: a moment that is not
valid shows the last valid one before it. After the window each frame follows from the ones before, so the motion ends
where it is first not valid, unless its limits say otherwise. Mechanics knows where a body is even where it has lost its
shape: there its rigid motion goes on, and its deformation is bounded (`ReducedSpace.bounded`). All follow from the
motion on fixed grids of times, whose intervals are refined where needed: never from the times that are asked for, nor
from their order.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from odeform.motion.limits import Limits
from odeform.motion.recent import Recent
from odeform.schema import Window
from odeform.types import Floats, Ints, Times

__all__ = [
    "CHUNK",
    "COARSE",
    "FINER",
    "VALID",
    "PlausibilityCheck",
    "Sample",
    "Stop",
    "energy_of",
    "faults_of",
    "wrong_with",
]

FINER = 2  # grid times per trained frame: a body that falls at 3 m/s moves by 12 mm between them
REFINED = 32  # parts of a grid interval, which are divided once more: 4 microseconds at 120 Hz
SLACK = 2.5e-4  # m by which a motion may sink deeper between two grid times; 0.08 mm is the most of 5,000 kicks
CHUNK = 44  # grid times after the window that are checked at once
COARSE = 16  # times in the window at which the energy is looked up
RECENT = 4  # results that are kept: pose, points and gradient of a time are evaluated one after the other

VALID, NON_FINITE, SUNK, DEFORMED, DRIVEN, INSIDE = range(6)
REASONS = {
    NON_FINITE: "it is not finite",
    SUNK: "it sinks into the floor",
    DEFORMED: "it deforms more than such a body can",
    DRIVEN: "it gains energy",
    INSIDE: "it sinks into the {}",
}


@dataclass(frozen=True, eq=False)
class Sample:
    """A motion at T times, as the model predicts it.

    `lowest` (T,) is the height of the lowest point of the trained body in metres, `deformation` (T,) its RMS
    deformation relative to the largest trained one, `centre` (T, 3) the position of its centre in metres. `inside` (T,)
    says whether the lowest point is one inside an obstacle, which counts as low as it is deep; None without obstacles.
    """

    lowest: Floats
    deformation: Floats
    centre: Float[np.ndarray, "times 3"]
    inside: Bool[np.ndarray, " times"] | None = None


@dataclass(frozen=True)
class Stop:
    """The last valid moment in seconds, which is shown in place of later ones, and what is wrong with them."""

    time: float
    reason: str
    for_good: bool = True
    """Whether the motion ends there; false where later moments are valid again, or may be."""
    limited: bool = False
    """Whether the motion goes on, with as much deformation as the body can have in place of more."""

    def __str__(self) -> str:
        if self.limited:
            return f"limited in its deformation at t = {self.time:.3f} s: {self.reason}"
        if self.for_good:
            return f"stopped at t = {self.time:.3f} s: {self.reason} afterwards"
        return f"held at t = {self.time:.3f} s while {self.reason}"


class PlausibilityCheck:
    """Times at which a motion is valid, and the times that are shown in place of others."""

    def __init__(
        self, limits: Limits, window: Window, sample: Callable[[Times], Sample], obstacle: str = "obstacle"
    ) -> None:
        """`sample` evaluates the motion at (T,) seconds of the model's clock, in any order and without this check;
        `obstacle` is what people call that in its way."""
        self._limits, self._window, self.sample, self._obstacle = limits, window, sample, obstacle
        self._step = 1.0 / (FINER * window.rate)
        self._steps = 0  # after the window, up to which the motion is known to be valid
        self._end: Stop | None = None
        self._recent: Recent[Times] = Recent(RECENT)

    def clamped(self, times: Times) -> Times:
        """(T,) seconds of the clock -> the seconds that are shown; the same where the motion is valid."""
        return self._recent.get(times.tobytes(), lambda: self._clamped(times))

    def stop_at(self, time: float) -> Stop | None:
        """Says what is shown in place of `time` (seconds of the clock) and why; None where it is shown itself."""
        if not self._alone(time):
            return self._after_window(time)
        if time <= self._window.start:
            return None
        wrong = self._wrong(np.array([time]))
        if faults_of(wrong, self._limits)[0] != VALID:
            return self._last_valid(time)
        return self._limited(time, int(wrong[0])) if wrong[0] != VALID else None

    def first_stop(self, until: float) -> Stop | None:
        """The first moment before `until` seconds of the clock from which on the motion is clamped or limited; checks
        all of it."""
        grid = self._grid(until)
        grid = grid[self._alone(grid)]
        wrong = self._wrong(grid)
        if wrong.any():
            first = int((wrong != VALID).argmax())
            if faults_of(wrong[first : first + 1], self._limits)[0] != VALID:
                return self._last_valid(float(grid[first]))
            return self._limited(float(grid[first]), int(wrong[first]))
        return None if self._alone(until) else self._after_window(until)

    def _limited(self, time: float, fault: int) -> Stop:
        return Stop(time, REASONS[fault].format(self._obstacle), for_good=False, limited=True)

    def _clamped(self, times: Times) -> Times:
        latest = float(times.max(initial=self._window.start))
        end = None if self._alone(latest) else self._after_window(latest)
        out = times if end is None else np.where(times > self._window.stop, np.minimum(times, end.time), times)
        inside = self._alone(out) & (out > self._window.start)
        # all are evaluated, also those that cannot be wrong: they are what is asked for next
        wrong = np.flatnonzero(inside & (self._faults(out) != VALID)) if inside.any() else []
        if len(wrong):
            out = out.copy()
            out[wrong] = [self._last_valid(float(time)).time for time in out[wrong]]
        return out

    def _alone(self, time: Any) -> Any:
        """Whether a time, or each of many, is checked by itself."""
        return time <= (self._window.stop if self._limits.ends else np.inf)

    def _grid(self, until: float) -> Times:
        """Times from the start of the window, where the body is at rest, to `until` s, without it."""
        # a time on the grid counts, however it was rounded
        count = math.floor((until - self._window.start) / self._step + 1e-9)
        return self._window.start + self._step * np.arange(1, count + 1)

    def _wrong(self, times: Times) -> Ints:
        """(T,) what is wrong, energy aside; `VALID` where nothing is."""
        return wrong_with(self.sample(times), self._limits) if len(times) else np.zeros(0, dtype=int)

    def _faults(self, times: Times) -> Ints:
        """(T,) that for which an earlier moment is shown."""
        return faults_of(self._wrong(times), self._limits)

    def _last_valid(self, time: float) -> Stop:
        """The last valid moment before `time`, which is checked by itself and not valid."""
        grid = self._grid(time)
        grid = grid[grid < time]
        valid = np.flatnonzero(self._faults(grid) == VALID)
        index = int(valid[-1]) + 1 if len(valid) else 0
        begin = float(grid[index - 1]) if index else self._window.start
        return replace(self._refined(begin, float(grid[index]) if index < len(grid) else time), for_good=False)

    def _refined(self, begin: float, end: float) -> Stop:
        """The last valid moment between a valid one and one that is not."""
        fault = VALID
        for _ in range(2):
            times = np.linspace(begin, end, REFINED + 1)
            faults = self._faults(times[1:])
            first = int((faults != VALID).argmax())
            begin, end, fault = float(times[first]), float(times[first + 1]), int(faults[first])
        return Stop(begin, REASONS.get(fault, "").format(self._obstacle))

    def _after_window(self, until: float) -> Stop | None:
        """The end of the motion, if it is before `until`."""
        while self._end is None and self._window.stop + self._steps * self._step < until:
            self._check_on()
        return self._end if self._end is not None and self._end.time < until else None

    def _check_on(self) -> None:
        """Check the next times after the window; for any request they are the same, in the same order."""
        steps, stop = self._steps, self._window.stop
        if not steps and self._faults(np.array([stop]))[0] != VALID:
            self._end = replace(self._last_valid(stop), for_good=True)
            return
        times = stop + self._step * np.arange(steps - 1, steps + CHUNK + 2)
        sample = self.sample(times)
        faults = faults_of(wrong_with(sample, self._limits), self._limits)[1:-1]
        driven = self._energy(times, sample) > self._limits.energy * self._most_energy
        faults[(faults == VALID) & driven] = DRIVEN
        wrong = np.flatnonzero(faults[1:] != VALID)
        if not len(wrong):
            self._steps = steps + CHUNK
            return
        first = int(wrong[0]) + 1
        before, after = float(times[first]), float(times[first + 1])
        self._end = Stop(before, REASONS[DRIVEN]) if faults[first] == DRIVEN else self._refined(before, after)

    def _energy(self, times: Times, sample: Sample) -> Floats:
        """(T - 2,) energy of the centre, per mass, at all but the first and the last of evenly spaced times."""
        return energy_of(times, sample.centre, self._ground, self._limits.gravity)

    @cached_property
    def _coarse(self) -> tuple[Times, Sample]:
        times = np.linspace(self._window.start, self._window.stop, COARSE + 1)[1:]
        return times, self.sample(times)

    @cached_property
    def _ground(self) -> float:
        """The lowest height of the centre in the window."""
        return float(self._coarse[1].centre[:, 2].min())

    @cached_property
    def _most_energy(self) -> float:
        """The largest energy in the window."""
        return float(self._energy(*self._coarse).max())


def energy_of(
    times: Times, centres: Float[np.ndarray, "*batch times 3"], ground: float | Floats, gravity: float
) -> Floats:
    """Computes (..., T - 2) energies of centres (..., T, 3) m above `ground` m, per mass, at all but the first and the
    last of evenly spaced `times` (T,) s."""
    with np.errstate(all="ignore"):
        speed = (centres[..., 2:, :] - centres[..., :-2, :]) / (times[2:] - times[:-2])[:, None]
        return gravity * (centres[..., 1:-1, 2] - ground) + 0.5 * (speed**2).sum(axis=-1)


def faults_of(wrong: Ints, limits: Limits) -> Ints:
    """(T,) that, of what is wrong, for which an earlier moment is shown; `VALID` elsewhere."""
    if limits.ends:
        return wrong
    return np.where(np.isin(wrong, (DEFORMED, SUNK, INSIDE) if limits.flat else (DEFORMED,)), VALID, wrong)


def wrong_with(sample: Sample, limits: Limits) -> Ints:
    """(T,) what is wrong with each moment, energy aside; `VALID` where nothing is."""
    finite = np.isfinite(sample.lowest) & np.isfinite(sample.deformation) & np.isfinite(sample.centre).all(axis=1)
    out = np.where(finite, VALID, NON_FINITE)
    with np.errstate(invalid="ignore"):
        out[finite & (sample.deformation > limits.deformation)] = DEFORMED
        if limits.floor is not None:
            out[finite & (sample.lowest < limits.floor - limits.depth + SLACK)] = SUNK
    if sample.inside is not None:
        out[(out == SUNK) & sample.inside] = INSIDE
    return out
