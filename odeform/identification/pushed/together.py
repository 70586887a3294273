"""One body in several experiments that were made with it, pushes, drops and throws, whose parameters are known."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from odeform.errors import InputError
from odeform.identification.pushed.experiment import Experiment
from odeform.identification.pushed.forward import Forward
from odeform.identification.pushed.state import FRICTION, PushState
from odeform.loads.measured import FALLS
from odeform.loads.registry import PUSH, get_load
from odeform.models.modal.model import ModalModel
from odeform.schema import Parameters
from odeform.simulation.contacts import vector_of
from odeform.types import Frames, Times

__all__ = ["Made", "Together", "simulated_together"]


@dataclass(frozen=True, eq=False)
class Made:
    """An experiment that was made, and when the body was looked at."""

    experiment: Experiment
    times: Times
    """(T,) s, ascending. Of a body that falls: from its first contact on, over at most 120 ms, for which the model's
    error was measured."""

    def of(self, state: PushState) -> Experiment:
        """The same experiment with the mass and stiffness of a state."""
        own = {"mass": state.value("mass"), "young": state.value("young")}
        return Experiment(self.experiment.load, {**self.experiment.parameters, **own})


class Together(Forward):
    """Motions of one body in each of the experiments, their frames one after the other.

    Of a state only the body counts; what happened to it is known.
    """

    def __init__(self, model: ModalModel, made: Sequence[Made], named: Parameters | None = None) -> None:
        """`InputError` for what is neither a push nor a drop or throw."""
        super().__init__(model, np.concatenate([one.times for one in made]), named)
        for load in {one.experiment.load for one in made} - {PUSH, *FALLS}:
            raise InputError(f"identify: expected pushes, drops and throws, got {load}")
        self.made = tuple(made)
        self._single = [Forward(model, one.times, named) for one in made]

    def without_residual(self) -> "Together":
        """Motions by mechanics alone: see `Forward.without_residual`."""
        return Together(self.model.without_residual(), self.made, self.named)

    def motions(self, states: Sequence[PushState]) -> Float[np.ndarray, "batch times points 3"]:
        """(B, T, S, 3) m: the surface of each body in all experiments."""
        return np.stack([np.concatenate(self.parts(state)) for state in states])

    def parts(self, state: PushState) -> list[Frames]:
        """(T, S, 3) m of each experiment."""
        out = []
        for one, forward in zip(self.made, self._single, strict=True):
            given = one.experiment.parameters
            if one.experiment.load == PUSH:
                out.append(forward.motions([_pushed(state, given)])[0])
            else:
                fallen = self.fallen(get_load(one.experiment.load), [given], state.body, one.times)
                out.append(fallen[0].astype(float))
        return out

    def check(self, state: PushState) -> None:
        """`InputError` where the sphere of a push does not fit once the body has settled."""
        for one, forward in zip(self.made, self._single, strict=True):
            if one.experiment.load == PUSH:
                forward.check(_pushed(state, one.experiment.parameters))


def _pushed(state: PushState, given: Parameters) -> PushState:
    return replace(state, contact=vector_of(given, "contact"), force=vector_of(given, "force"))


def simulated_together(
    forward: Together, simulate: Callable[[Experiment, float, Times], Frames]
) -> Callable[[PushState], Frames]:
    """Returns what simulates all experiments with the body of a state, at once, by `experiment_simulator`."""

    def simulated(state: PushState) -> Frames:
        # the simulator lets other threads run meanwhile
        with ThreadPoolExecutor(len(forward.made)) as pool:
            friction = state.value(FRICTION)
            surfaces = pool.map(lambda one: simulate(one.of(state), friction, one.times), forward.made)
            return np.concatenate([*surfaces])

    return simulated
