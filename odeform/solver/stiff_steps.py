"""Controlled steps of a stiff field that takes many of them at once, in machine code."""

from collections.abc import Callable
from typing import Protocol, runtime_checkable

import numpy as np

from odeform.solver.linearly_implicit import LinearlyImplicit, StiffField
from odeform.solver.solution import Solution, Status
from odeform.solver.step_control import GROW, MAX_STEPS, SAFETY, SHRINK

__all__ = ["FollowedField", "follow"]

ROOM = 64  # nodes of one call: a few milliseconds


@runtime_checkable
class FollowedField(StiffField, Protocol):
    """A field that may take many steps by itself."""

    @property
    def follow(self) -> Callable[..., int] | None:
        """Returns how many nodes there are after a call with the numbers of the control, and arrays that it fills; see
        `odeform.mechanics.compiled_push.follow`. None where only single steps can be taken."""
        ...


def follow(
    steps: Callable[..., int],
    method: LinearlyImplicit,
    tolerance: float,
    solution: Solution,
    until: float,
    before_steps: Callable[[], None],
) -> None:
    """Go on with a solution whose next step is known, as single steps would, to the bit. `before_steps` is called about
    every `ROOM` steps, and may raise."""
    order, gains = method.order, method.gains
    control = (
        until, tolerance, float(MAX_STEPS), SHRINK, GROW, SAFETY, -1.0 / order, -gains[0] / order, gains[1] / order
    )  # fmt: skip
    size = len(solution.states[0])
    while solution.end < until:
        before_steps()
        times, states, slopes = np.empty(ROOM), np.empty((ROOM, size)), np.empty((ROOM, size))
        times[0], states[0], slopes[0] = solution.end, solution.states[-1], solution.slopes[-1]
        rates, tried = (
            np.array([solution.next_step, solution.last_ratio]),
            np.array([solution.steps, solution.rejected]),
        )
        before = int(tried.sum())
        with np.errstate(all="ignore"):  # an overflow ends the integration with a status
            count = steps(control, times, states, slopes, rates, tried)
        solution.evaluations += 3 * (int(tried.sum()) - before)
        solution.next_step, solution.last_ratio = rates.tolist()
        solution.rejected = int(tried[1])
        solution.states += list(states[1:count])
        solution.slopes += list(slopes[1:count])
        solution.times += times[1:count].tolist()  # last: what other threads read is then complete
        if solution.end < until and count < ROOM:
            many = int(tried.sum()) >= MAX_STEPS
            solution.status = Status.MAX_STEPS if many else Status.UNDERFLOW
            return
