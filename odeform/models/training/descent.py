"""Defines what gradient descents use: budget, loop, learning-rate schedule, and settings of the processor."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import torch
from threadpoolctl import threadpool_limits

__all__ = ["Budget", "Learner", "cosine_decay", "descend", "small_batches"]

VALIDATIONS = 25  # over the length of a training


@dataclass(frozen=True)
class Budget:
    """Training budget including trials: processor time in seconds, or a number of steps where one is given."""

    seconds: float
    steps: int | None = None

    def part(self, fraction: float) -> "Budget":
        """A fraction in (0, 1] of this budget, at least one step."""
        return Budget(fraction * self.seconds, None if self.steps is None else max(round(fraction * self.steps), 1))

    def spent(self, done: int, elapsed: float) -> float:
        """The fraction that is spent after `done` steps and `elapsed` seconds."""
        return done / self.steps if self.steps is not None else elapsed / self.seconds


@runtime_checkable
class Learner(Protocol):
    """Describes what is trained step by step."""

    done: int
    """Steps."""
    elapsed: float
    """Seconds of processor time."""

    def advance(self, fraction: float) -> float:
        """Take one step, at this fraction of the training; returns its loss."""
        ...

    def validate(self) -> float:
        """Error in mm on validation; keeps the weights if they are the best so far."""
        ...


def descend(
    learner: Learner,
    budget: Budget,
    report: Callable[[str], None],
    keep: Callable[[], None] = lambda: None,
    between: int = 0,
) -> None:
    """Take steps until the budget is spent. Validations are at least `between` steps apart; `keep` is called after
    each."""
    begin, validated = time.process_time() - learner.elapsed, learner.done
    fraction = budget.spent(learner.done, learner.elapsed)
    validations = int(fraction * VALIDATIONS)
    while fraction < 1.0:
        loss = learner.advance(fraction)
        learner.elapsed = time.process_time() - begin
        fraction = budget.spent(learner.done, learner.elapsed)
        if fraction >= 1.0 or (fraction * VALIDATIONS >= validations + 1 and learner.done >= validated + between):
            validations, validated = int(fraction * VALIDATIONS), learner.done
            error = learner.validate()
            report(f"{100 * fraction:.0f} %, step {learner.done}: loss {loss:.3g}, {error:.3f} mm (val)")
            keep()


def cosine_decay(fraction: float) -> float:
    """Returns the factor of the learning rate at this fraction of the training: from 1 to 0 (Loshchilov & Hutter
    2017)."""
    return 0.5 * (1.0 + math.cos(math.pi * fraction))


@contextmanager
def small_batches() -> Iterator[None]:
    """Computes on one thread of the processor, without denormal numbers.

    Batches are small; with one thread the results do not depend on the number of cores, and the threads of a product
    do not wait for each other beside other programs. Denormal numbers slow training thirty-fold on some processors.
    Elsewhere they matter: SciPy's k-d tree recurses without end where they are flushed to 0.
    """
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    try:
        with threadpool_limits(1, "blas"):
            yield
    finally:
        torch.set_num_threads(threads)
        torch.set_flush_denormal(False)
