"""Corrects the model by simulations of what was estimated with it, and estimates again.

A model that is right to a millimetre explains what it misses by another body. Simulated at the estimate, the body says
what the model misses there. Added to the model, that is exact at the estimate and nearly right around it, so that the
next estimate is nearer (space mapping, Bandler et al. 1994). How what is missed changes from one estimate to the next
is added as well, as far as the estimates so far tell (manifold mapping, Echeverria and Hemker 2005).
"""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from odeform.identification.pushed.forward import Forward
from odeform.identification.pushed.search import Found, Problem, misfit_of, refined
from odeform.identification.pushed.state import BODY, PushState
from odeform.simulation.errors import SimulationError
from odeform.types import Floats, Frames, Times

__all__ = ["Corrected", "Correction", "corrected_search"]

UNSURE = 0.01
"""Squared distance between estimates, in units of `PushState.vector`, below which they say little of how what the model
misses changes."""
LEFT = 0.5
"""Of what the last correction missed at its own estimate, what the next one is expected to miss."""
END = 0.98
"""Of a range, from which on an estimate lies at its end."""
ENOUGH_MM = 0.02
"""RMS distance of a simulation from what was expected there, below which another one tells nothing more."""


@dataclass(frozen=True, eq=False)
class _Simulated:
    at: Floats
    missed: Frames


class Corrected(Forward):
    """Motions of a model, with what simulations found that it misses."""

    def __init__(self, forward: Forward) -> None:
        """Misses nothing yet."""
        super().__init__(forward.model, forward.times, forward.named)
        self._model, self._known = forward, tuple[_Simulated, ...]()

    def with_simulated(self, state: PushState, surface: Frames) -> "Corrected":
        """Returns the model that has the surface (T, S, 3) m at `state`."""
        out = copy(self)
        out._known = (*self._known, _Simulated(state.vector, surface - self._model.motions([state])[0]))
        return out

    def motions(self, states: Sequence[PushState]) -> Float[np.ndarray, "batch times points 3"]:
        """(B, T, S, 3) m: the surface for states of one and the same body."""
        moved = self._model.motions(states)
        if not self._known:
            return moved
        return moved + np.stack([self._missed(state.vector) for state in states])

    def check(self, state: PushState) -> None:
        """`InputError` where the model cannot move a body."""
        self._model.check(state)

    def _missed(self, vector: Floats) -> Frames:
        """(T, S, 3) m at a state: what was missed last, and its change along the way from the estimates before it."""
        *before, last = self._known
        if not before:
            return last.missed
        ways = np.stack([one.at - last.at for one in before])
        gram = ways @ ways.T + UNSURE * np.eye(len(ways))
        shares = np.linalg.solve(gram, ways @ (vector - last.at))
        return last.missed + sum(share * (one.missed - last.missed) for share, one in zip(shares, before, strict=True))


@dataclass(frozen=True, eq=False)
class Correction:
    """What a search with simulations came to."""

    problem: Problem
    """With the corrected model, whose errors are what it missed of the last simulation."""
    found: Found
    last: Floats
    """(9,) the last step of the estimate, in units of `PushState.vector`: how far it may be from where it would end."""
    simulations: int
    """How many succeeded."""
    stopped: str = ""
    """Why no more of them did."""


def corrected_search(
    problem: Problem,
    found: Found,
    simulate: Callable[[PushState], Frames],
    most: int,
    progress: Callable[[PushState, float], None] = lambda *_: None,
    note: Callable[[str], None] = lambda _: None,
) -> Correction:
    """Estimates again with up to `most` simulations (T, S, 3) m, each at the estimate before it, and mechanics alone.

    The first is in the middle of a range at whose end the estimate lies.

    It ends at a body that cannot be simulated, or where a simulation was as expected.
    """
    model, tried = Corrected(problem.forward.without_residual()), list[tuple[PushState, Frames]]()
    last = np.zeros(len(found.state.vector))
    for count in range(most):
        note(f"Simulating the estimate ({count + 1} of at most {most})")
        at = found.state if tried else _inside(problem, found.state)
        try:
            surface = simulate(at)
        except SimulationError as error:
            return Correction(problem, found, last, count, str(error))
        missed = _rms_mm(surface - model.motions([at])[0])
        model = model.with_simulated(at, surface)
        # at first, what the model itself is expected to miss bounds it
        errors = np.minimum(LEFT * missed, problem.errors_mm) if count == 0 else LEFT * missed
        problem = replace(problem, forward=model, errors_mm=errors)
        tried.append((at, surface))
        misfits = [misfit_of(problem, *one) for one in tried]
        before, found = found, refined(problem, tried[int(np.argmin(misfits))][0], progress)
        last = found.state.vector - before.state.vector
        if float(np.sqrt((missed**2).mean())) < ENOUGH_MM:
            return Correction(problem, found, last, count + 1)
    return Correction(problem, found, last, most)


def _inside(problem: Problem, state: PushState) -> PushState:
    """The state with the middle of each range of the body at whose end it lies. There a model that is wrong leads, and
    what it misses there leads back no more."""
    free = np.isin(np.arange(len(BODY)), problem.free)
    return replace(state, body=np.where(free & (np.abs(state.body) > END), 0.0, state.body))


def _rms_mm(away: Frames) -> Times:
    """(T,) mm of (T, S, 3) m."""
    return 1e3 * np.sqrt((away**2).sum(axis=2).mean(axis=1))
