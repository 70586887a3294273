"""Finds which of many motions are physically possible up to a time; the others are checked one by one
(`plausibility.py`)."""

import math
from collections.abc import Callable
from functools import cached_property

import numpy as np
from jaxtyping import Bool

from odeform.motion.limits import Limits
from odeform.motion.plausibility import CHUNK, COARSE, FINER, VALID, Sample, energy_of, faults_of, wrong_with
from odeform.schema import Window
from odeform.types import Floats, Times

__all__ = ["BatchPlausibility"]

Valid = Bool[np.ndarray, " batch"]


class BatchPlausibility:
    """Looks at the same times as `PlausibilityCheck` does for one motion, at many motions at once."""

    def __init__(self, limits: Limits, window: Window, count: int, sample: Callable[[Times], Sample]) -> None:
        """`sample` evaluates `count` motions at (T,) seconds of the model's clock: entries of its `Sample` are those of
        all motions (B T,), one motion after the other."""
        self._limits, self._window, self._count, self._sample = limits, window, count, sample
        self._step = 1.0 / (FINER * window.rate)
        self._steps = 0  # after the window, up to which it is known where motions are valid
        self._later = np.ones(count, dtype=bool)

    def valid(self, times: Times, sample: Sample) -> Valid:
        """(B,) whether motions may be shown as they are at all of `times` (T,), where they are as in `sample`. What is
        false may still be valid, at times between those that are looked at."""
        inside = (times <= (self._window.stop if self._limits.ends else np.inf)) & (times > self._window.start)
        wrong = self._wrong(sample)[:, inside].any(axis=1)
        latest = float(times.max(initial=self._window.start))
        return ~wrong & self.valid_until(latest)

    def valid_throughout(self, latest: float) -> Valid:
        """(B,) whether motions are valid at all times of the grid, up to `latest` seconds of the clock."""
        stop = self._window.stop if self._limits.ends else latest
        count = math.floor((stop - self._window.start) / self._step + 1e-9)
        grid = self._window.start + self._step * np.arange(1, count + 1)
        return ~self._wrong(self._sample(grid)).any(axis=1) & self.valid_until(latest)

    def valid_until(self, latest: float) -> Valid:
        """(B,) whether motions are valid after the window, up to `latest` seconds of the clock."""
        while self._limits.ends and self._window.stop + self._steps * self._step < latest:
            self._check_on()
        return self._later

    def _wrong(self, sample: Sample) -> Bool[np.ndarray, "batch times"]:
        return (faults_of(wrong_with(sample, self._limits), self._limits) != VALID).reshape(self._count, -1)

    def _check_on(self) -> None:
        stop = self._window.stop
        if not self._steps:
            self._later = ~self._wrong(self._sample(np.array([stop])))[:, 0]
        times = stop + self._step * np.arange(self._steps - 1, self._steps + CHUNK + 2)
        sample = self._sample(times)
        driven = self._energy(times, sample) > self._limits.energy * self._most_energy[:, None]
        wrong = self._wrong(sample)[:, 1:-1] | driven
        self._later &= ~wrong[:, 1:].any(axis=1)
        self._steps += CHUNK

    def _energy(self, times: Times, sample: Sample) -> Floats:
        """(B, T - 2), as of one motion."""
        centres = sample.centre.reshape(self._count, -1, 3)
        ground = self._coarse[1].centre.reshape(self._count, -1, 3)[..., 2].min(axis=1)
        return energy_of(times, centres, ground[:, None], self._limits.gravity)

    @cached_property
    def _coarse(self) -> tuple[Times, Sample]:
        times = np.linspace(self._window.start, self._window.stop, COARSE + 1)[1:]
        return times, self._sample(times)

    @cached_property
    def _most_energy(self) -> Floats:
        """(B,) the largest energies in the window."""
        return self._energy(*self._coarse).max(axis=1)
