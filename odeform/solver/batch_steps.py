"""Single steps of many states at once, each of a length of its own."""

from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Int

from odeform.errors import InputError
from odeform.solver.integrate import SolverSettings
from odeform.solver.linearly_implicit import LinearlyImplicit
from odeform.solver.method import Field, Method
from odeform.solver.registry import get_method
from odeform.solver.runge_kutta import ExplicitRungeKutta, gemv, weights_of
from odeform.solver.tableau import Tableau
from odeform.types import Floats

__all__ = [
    "BatchField",
    "BatchStages",
    "BatchStepper",
    "StiffBatchField",
    "Together",
    "batch_stepper",
    "can_batch",
    "rms",
]

Rows = Int[np.ndarray, " rows"]
Each = Float[np.ndarray, " rows"]
States = Float[np.ndarray, "rows state"]

IN_PLACE = (0, 1, 0, 1, 0, 1)  # arguments of BLAS's gemv: no offsets, no transposition, y is overwritten


@runtime_checkable
class BatchField(Protocol):
    """The right-hand sides of many problems."""

    def __call__(self, rows: Rows, times: Each, states: States) -> States:
        """Returns the slopes (R, n) at states (R, n) and times (R,) in s of the problems `rows` (R,), increasing
        indices."""
        ...


class Together:
    """The fields of many problems, one by one: each bit of a slope is as it would be alone."""

    def __init__(self, fields: Sequence[Field]) -> None:
        self.fields = fields

    def __call__(self, rows: Rows, times: Each, states: States) -> States:
        """See `BatchField`."""
        each = zip(rows.tolist(), times.tolist(), states, strict=True)
        return np.stack([self.fields[row](time, state) for row, time, state in each])


@runtime_checkable
class StiffBatchField(BatchField, Protocol):
    """Fields that know how to solve for their own steps, as `odeform.solver.linearly_implicit.StiffField`."""

    def advance(self, rows: Rows, times: Each, states: States, steps: Each) -> tuple[States, States, Each]:
        """States (R, n) after `steps` (R,) in s, slopes there, and estimated errors (R,) of the steps."""
        ...


@runtime_checkable
class BatchStepper(Protocol):
    """Takes steps, each as the `Stepper` of one problem would take it."""

    evaluations: int

    def step(
        self, field: Any, rows: Rows, times: Each, states: States, slopes: States, steps: Each
    ) -> tuple[States, States]:
        """One step from `states` with `slopes`: the states after it, and the slopes there."""
        ...

    def errors(self, steps: Each) -> Each:
        """(R,) root mean squares of the estimated errors of the last steps."""
        ...

    def middles(self, states: States, steps: Each) -> States:
        """States halfway through the last steps, which began at `states`."""
        ...


class BatchStages:
    """Steps by one `tableau`, for up to `count` states of `size` numbers.

    Sums of slopes are the same products as those of `Stages`, one problem at a time: they take little of a step, and
    every bit of a motion is as it would be alone.
    """

    def __init__(self, tableau: Tableau, count: int, size: int, dtype: np.dtype) -> None:
        self._weights = weights_of(tableau, dtype)
        self.evaluations = len(self._weights.stages)
        self._slopes = np.empty((count, self.evaluations + 1, size), dtype)
        self._product = gemv(dtype)
        counts = {len(weights) for weights in (*self._weights.stages, self._weights.error, self._weights.middle)}
        # columns of each problem, as BLAS wants them
        self._columns = {k: [slopes.T[:, :k] for slopes in self._slopes] for k in counts}

    def _advanced(self, states: States, weights: Floats, steps: Each) -> States:
        out = np.array(states, order="C")
        product = self._product
        for step, columns, y in zip(steps.tolist(), self._columns[len(weights)], out, strict=False):
            product(step, columns, weights, 1.0, y, *IN_PLACE)
        return out

    def step(
        self, field: BatchField, rows: Rows, times: Each, states: States, slopes: States, steps: Each
    ) -> tuple[States, States]:
        """One step from `states` with `slopes`: the states after it, and the slopes there."""
        kept, after = self._slopes[: len(rows)], states
        kept[:, 0] = slopes
        for index, (weights, node) in enumerate(zip(self._weights.stages, self._weights.nodes, strict=True)):
            after = self._advanced(states, weights, steps)
            slopes = field(rows, times + node * steps, after)
            kept[:, index + 1] = slopes
        return after, slopes

    def errors(self, steps: Each) -> Each:
        """(R,) root mean squares of the errors of the last steps, as the embedded method estimates them."""
        product, weights = self._product, self._weights.error
        columns = zip(steps.tolist(), self._columns[len(weights)], strict=False)
        return rms([product(step, column, weights) for step, column in columns])

    def middles(self, states: States, steps: Each) -> States:
        """States halfway through the last steps, which began at `states`."""
        return self._advanced(states, self._weights.middle, steps)


class _Implicit:
    """Steps of a `StiffBatchField`."""

    evaluations = 3  # a whole step and two halves

    def __init__(self) -> None:
        self._errors = np.zeros(0)

    def step(
        self, field: StiffBatchField, rows: Rows, times: Each, states: States, slopes: States, steps: Each
    ) -> tuple[States, States]:
        """One step from `states`: the states after it, and the slopes there."""
        after, slopes, self._errors = field.advance(rows, times, states, steps)
        return after, slopes

    def errors(self, steps: Each) -> Each:
        """(R,) as the field estimates them."""
        return self._errors

    def middles(self, states: States, steps: Each) -> States:
        """Not asked for."""
        raise NotImplementedError


def rms(values: Any) -> Each:
    """(R,) root mean squares of the rows of an array, or of a list of arrays."""
    # one product a row, as for a single problem: others round differently
    return np.sqrt(np.array([float(row.dot(row)) / row.size for row in values]))


def can_batch(settings: SolverSettings) -> bool:
    """Whether many problems can be solved at once with these settings: methods of others may not be able to."""
    return isinstance(get_method(settings.method), ExplicitRungeKutta | LinearlyImplicit)


def batch_stepper(method: Method, field: BatchField, start: Float[np.ndarray, "batch state"]) -> BatchStepper:
    """The stepper of `method` for states like `start`. `InputError` for a field that has no steps of its own, where the
    method asks for them."""
    if isinstance(method, ExplicitRungeKutta):
        return BatchStages(method.tableau, start.shape[0], start.shape[1], start.dtype)
    if not isinstance(field, StiffBatchField):
        raise InputError(f"solver {method.name}: expected the field of a mechanical model")
    return _Implicit()
