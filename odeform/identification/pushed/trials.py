"""Experiments that could be made with a body, and how its surface would move in each, as it is or as another body."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from odeform.errors import InputError
from odeform.identification.pushed.experiment import Experiment
from odeform.identification.pushed.forward import Forward
from odeform.identification.pushed.state import BODY, FRICTION, PushState
from odeform.loads.load import Load
from odeform.loads.registry import PUSH
from odeform.models.modal.training.impact_fit import FRAMES, first_contact
from odeform.simulation.contact_draws import contact_draws
from odeform.simulation.scene import evenly
from odeform.types import Floats, Times

__all__ = ["Falls", "Pushes", "Trials"]

Surfaces = Float[np.ndarray, "experiments times points 3"]


@runtime_checkable
class Trials(Protocol):
    """E experiments, each observed at T times; the surface of the body has S vertices."""

    experiments: list[Experiment]
    times: Float[np.ndarray, "experiments times"]
    """s"""
    errors_mm: Float[np.ndarray, "experiments times"]
    """RMS displacement by which the model is wrong, as was measured of the body as it is by itself."""

    def surfaces(self, body: Floats) -> Surfaces:
        """(E, T, S, 3) m of a body (3,), `BODY` in [-1, 1]."""
        ...


class Pushes:
    """Pushes of a sphere that fits at several bodies alike."""

    def __init__(
        self,
        forward: Forward,
        bodies: Sequence[Floats],
        forces: tuple[float, float],
        errors_mm: Times,
        count: int,
        seed: int,
    ) -> None:
        """Draws at most `count` pushes from the weakest to the strongest of `forces` in newton. The first of the
        `bodies` (3,) is as it is estimated, of which the model is wrong by `errors_mm` (T,)."""
        self._forward = forward
        drawn = contact_draws(forward.model.rest, forces, count, [seed, 2])
        states = [forward.state(contact, force, bodies[0], forces[1]) for contact, force in drawn]
        self._states = [state for state in states if all(_fits(forward, replace(state, body=body)) for body in bodies)]
        self.experiments = [Experiment(PUSH, state.parameters()) for state in self._states]
        self.times, self.errors_mm = (np.tile(row, (len(self._states), 1)) for row in (forward.times, errors_mm))

    def surfaces(self, body: Floats) -> Surfaces:
        """(E, T, S, 3) m of a body (3,): see `Trials`."""
        return self._forward.motions([replace(state, body=body) for state in self._states])


def _fits(forward: Forward, state: PushState) -> bool:
    try:
        forward.check(state)
    except InputError:
        return False
    return True


class Falls:
    """Drops or throws, each observed for 120 ms from its first contact with the floor, as its error was measured."""

    def __init__(self, forward: Forward, body: Floats, load: Load, count: int, seed: int) -> None:
        """Draws `count` evenly from the ranges of a load, and leaves out what lands too late. `body` (3,) is as it is
        estimated; others fly alike, and land at the same time."""
        self._forward, self._load = forward, load
        self._drawn, self._solved_at = evenly(load.parameters, count, seed), load.window.times
        moved = self._solved(body)
        firsts = np.array([first_contact(motion, load, row) for motion, row in zip(moved, self._drawn, strict=True)])
        kept = np.flatnonzero((firsts > 0) & (firsts + FRAMES < len(self._solved_at)))
        self._drawn = [self._drawn[index] for index in kept]
        self._seen = firsts[kept, None] + np.arange(FRAMES + 1)
        self.times = self._solved_at[self._seen]
        self._solved_at = self._solved_at[: int(self._seen.max(initial=0)) + 1]
        self.experiments = [Experiment(load.name, {**row, **self._of(body)}) for row in self._drawn]
        self._body, self._base = body, self._observed(moved[kept])
        self.errors_mm = np.array([forward.fall_errors(one) for one in self._base]).reshape(self.times.shape)

    def surfaces(self, body: Floats) -> Surfaces:
        """(E, T, S, 3) m of a body (3,): see `Trials`."""
        return self._base if np.array_equal(body, self._body) else self._observed(self._solved(body))

    def _of(self, body: Floats) -> dict[str, float]:
        """Mass and stiffness of a body (3,)."""
        pairs = zip(BODY, self._forward.ranges, body, strict=True)
        return {name: one.denormalise(float(unit)) for name, one, unit in pairs if name != FRICTION}

    def _solved(self, body: Floats) -> Surfaces:
        return self._forward.fallen(self._load, self._drawn, body, self._solved_at)

    def _observed(self, moved: Float[np.ndarray, "experiments frames points 3"]) -> Surfaces:
        return moved[np.arange(len(moved))[:, None], self._seen].astype(float)
