"""Fields whose integration runs as machine code, and how a solution of one of them is continued.

Such a field is autonomous. What it takes from a motion, and what all motions share, are plain arrays, so that one loop
solves one motion or many, each to the same bits.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from odeform.solver.runge_kutta import weights_of
from odeform.solver.solution import Solution, Status
from odeform.solver.step_control import GAINS, MAX_STEPS
from odeform.solver.tableau import Tableau
from odeform.types import Floats, Ints

__all__ = ["Call", "CompiledField", "Nodes", "Rule", "machine_code", "solve_together"]

ROOM = 256  # nodes that are made room for at first
Call = Callable[[], None]


@cache
def machine_code(slope: Callable[..., None], dtype: str) -> Any:
    """Compile `slope(state, own, shared, sizes, out)`, plain Python on contiguous arrays of a precision (`sizes`:
    integers), under `no_type_check`. Numba keeps the result on disk; the first time takes seconds."""
    from numba import cfunc, from_dtype, types, void

    array, sizes = types.Array(from_dtype(np.dtype(dtype)), 1, "C"), types.Array(types.int64, 1, "C")
    signature = void(array, array, array, sizes, array)
    code = cfunc(signature, cache=True, error_model="numpy")(slope)
    # looked up in each call, it would take longer than a few steps
    setattr(code, "_numba_type_", types.FunctionType(signature))  # noqa: B010
    return code


class CompiledField:
    """The field of one motion, in the precision of `shared`."""

    def __init__(self, slope: Callable[..., None], own: Floats, shared: Floats, sizes: Ints) -> None:
        """The `slope` is as `machine_code` compiles it; `own` (k,), `shared` (m,) and `sizes` are what it is given."""
        self._slope, self.own, self._shared, self._sizes = slope, own, shared, sizes

    @property
    def dtype(self) -> np.dtype:
        """The precision of states, whatever that of the start."""
        return self._shared.dtype

    @property
    def given(self) -> tuple[Any, Floats, Ints]:
        """Holds what the compiled loop is given of all motions: the code of the slope, `shared` (M,), `sizes` (S,)."""
        return machine_code(self._slope, self.dtype.name), self._shared, self._sizes

    def __call__(self, time: float, state: Any) -> Any:
        """Returns the slope (n,) at a state (n,)."""
        from odeform.solver.compiled_loop import slopes_of

        code, shared, sizes = self.given
        states = np.asarray(state, shared.dtype)[None]
        out = np.empty_like(states)
        slopes_of(code, self.own[None], shared, sizes, states, out)
        return out[0]

    def extend(self, solution: Solution, rule: "Rule", until: float, before_call: Call) -> None:
        """Go on with a `solution` of this field, or begin one without evaluations, to `until` seconds at least.

        `before_call` may raise; it is called about every `ROOM` steps."""
        with solution.lock:
            begun = solution.evaluations > 0
            if begun and (solution.status is not Status.OK or solution.end >= until):
                return
            states, slopes = (np.asarray(part[-1], self.dtype)[None] for part in (solution.states, solution.slopes))
            nodes = Nodes.begin(np.array([solution.end]), states, slopes, rule.bends)
            nodes.rates[0] = solution.next_step, solution.last_ratio
            nodes.tallies[0] = solution.steps, solution.rejected, solution.evaluations
            nodes = solve_together([self], nodes, rule, solution.times[0], until, before_call)
            last = int(nodes.counts[0])
            solution.slopes[-1] = nodes.slopes[0, 0]  # at the very start, they are found now
            solution.states += list(nodes.states[0, 1:last])
            solution.slopes += list(nodes.slopes[0, 1:last])
            if rule.bends:
                solution.middles += list(nodes.middles[0, : last - 1])
            solution.next_step, solution.last_ratio = nodes.rates[0].tolist()
            _, solution.rejected, solution.evaluations = nodes.tallies[0].tolist()
            solution.status = nodes.statuses[0]
            solution.times += nodes.times[0, 1:last].tolist()  # last: what other threads read is then complete


class Rule(NamedTuple):
    """A method, and how long its steps are."""

    tableau: Tableau
    step: float | None
    """s; None where the tolerance decides."""
    tolerance: float | None
    most: int = MAX_STEPS

    @property
    def bends(self) -> bool:
        """Whether states halfway through the steps are known."""
        return self.tableau.middle is not None and self.tolerance is not None


class Nodes(NamedTuple):
    """Holds the nodes of B problems, as `odeform.solver.compiled_loop.advance` writes them; unused times are
    infinite."""

    times: Float[np.ndarray, "batch nodes"]
    states: Float[np.ndarray, "batch nodes state"]
    slopes: Float[np.ndarray, "batch nodes state"]
    middles: Float[np.ndarray, "batch nodes state"]
    counts: Int[np.ndarray, " batch"]
    rates: Float[np.ndarray, "batch 2"]
    tallies: Int[np.ndarray, "batch 3"]
    ended: Int[np.ndarray, " batch"]

    @classmethod
    def begin(cls, times: Floats, states: Floats, slopes: Floats, bends: bool) -> "Nodes":
        """Returns the first nodes, at (B,) s: states (B, n) and slopes (B, n)."""
        count, size = states.shape

        def room(first: Floats) -> Floats:
            out = np.empty((count, ROOM, size), states.dtype)
            out[:, 0] = first
            return out

        every = np.full((count, ROOM), np.inf)
        every[:, 0] = times
        middles = np.zeros((count, ROOM if bends else 1, size), states.dtype)
        rates, tallies = np.zeros((count, 2)), np.zeros((count, 3), int)
        rates[:, 1] = 1.0
        ones, zeros = np.ones(count, int), np.zeros(count, int)
        return cls(every, room(states), room(slopes), middles, ones, rates, tallies, zeros)

    def doubled(self) -> "Nodes":
        """Returns the same with room for twice as many."""

        def grown(part: Floats) -> Floats:
            return np.concatenate([part, np.zeros_like(part)], axis=1)

        times = np.concatenate([self.times, np.full_like(self.times, np.inf)], axis=1)
        states, slopes, middles = (grown(part) for part in (self.states, self.slopes, self.middles))
        return self._replace(times=times, states=states, slopes=slopes, middles=middles)

    @property
    def statuses(self) -> list[Status]:
        """(B,) how the problems ended."""
        known = [Status.OK, Status.OK, Status.MAX_STEPS, Status.UNDERFLOW, Status.NON_FINITE]
        return [known[how] for how in self.ended.tolist()]


def solve_together(
    fields: Sequence[CompiledField], nodes: Nodes, rule: Rule, begin: float, until: float, before_call: Call
) -> Nodes:
    """Solve B problems with fields of one kind, which began at `begin` seconds, from the last of their `nodes` on."""
    from odeform.solver.compiled_loop import FULL, advance

    tableau, weights = rule.tableau, weights_of(rule.tableau, np.dtype(float))
    stages = np.zeros((len(weights.stages),) * 2)
    for row, known in zip(stages, weights.stages, strict=True):
        row[: len(known)] = known
    code, shared, sizes = fields[0].given
    own = np.stack([field.own for field in fields])
    method = stages, weights.error, weights.middle, tableau.order, GAINS
    length = rule.step or 0.0, rule.tolerance or 0.0, rule.most
    while True:
        before_call()
        advance(code, own, shared, sizes, *method, *length, begin, until, *nodes)
        if not (nodes.ended == FULL).any():
            return nodes
        nodes = nodes.doubled()
