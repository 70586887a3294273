"""Run a simulated body and record its frames."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from odeform.types import Floats

__all__ = ["Body", "Rest", "run"]


@runtime_checkable
class Body(Protocol):
    """A body that a simulator advances: a shell, a solid, anything whose state is the motion of its vertices."""

    @property
    def timestep(self) -> float:
        """The step of the simulation, s."""
        ...

    @property
    def weights(self) -> Floats:
        """(N,) mass fraction at each vertex, summing to 1."""
        ...

    @property
    def positions(self) -> Floats:
        """(N, 3) metres, a copy."""
        ...

    @property
    def velocities(self) -> Floats:
        """(N, 3) m/s, a view."""
        ...

    def step(self, force: Floats | None = None) -> None:
        """Advance by one time step under `force` (N, 3) in newton at the vertices."""
        ...

    def check(self) -> None:
        """Raise `SimulationError` unless the run so far is sound."""
        ...


@dataclass(frozen=True)
class Rest:
    """A body counts as at rest once its RMS speed over the mass stays below `speed` m/s for `time` seconds."""

    speed: float
    time: float


def run(
    body: Body,
    until: float,
    rate: float,
    force: Callable[[float], Floats | None] = lambda _: None,
    begin: float = 0.0,
    rest: Rest | None = None,
    report: Callable[[float], None] = lambda _: None,
) -> tuple[Floats, Floats]:
    """Step the body from `begin` to `until` seconds, or until it rests; `force(time)` is (N, 3) in newton.

    Returns times (T,) s on the grid k / rate within that span, and vertices (T, N, 3) m. `report` is called every 50
    steps with the simulated time in seconds. Frames that fall between steps are interpolated with the velocities of
    both sides (cubic Hermite), so that the step never depends on the frame rate.
    """
    step = body.timestep
    first = math.ceil(begin * rate - 1e-9)
    times = np.arange(first, round(until * rate) + 1) / rate
    frames = [body.positions] if times[0] <= begin + 1e-9 else []
    now, here, speed = begin, body.positions, body.velocities.copy()
    still = 0.0
    for index in range(1, round((until - begin) / step) + 1):
        body.step(force(now + 0.5 * step))
        if index % 50 == 0:
            report(now)
        after, there, speed_there = begin + index * step, body.positions, body.velocities.copy()
        while len(frames) < len(times) and times[len(frames)] <= after + 1e-9:
            s = (times[len(frames)] - now) / step
            frames.append(
                (1 + 2 * s) * (1 - s) ** 2 * here
                + s * (1 - s) ** 2 * step * speed
                + s**2 * (3 - 2 * s) * there
                + s**2 * (s - 1) * step * speed_there
            )
        now, here, speed = after, there, speed_there
        if rest is not None:
            still = still + step if body.weights @ (speed**2).sum(axis=1) < rest.speed**2 else 0.0
            if still >= rest.time:
                break
    body.check()
    return times[: len(frames)], np.stack(frames)
