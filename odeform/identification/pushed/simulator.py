"""Moves a body by the simulator, in place of the model."""

from collections.abc import Callable
from dataclasses import replace

from scipy.interpolate import CubicSpline

from odeform.errors import InputError
from odeform.identification.pushed.experiment import Experiment
from odeform.identification.pushed.forward import Forward
from odeform.identification.pushed.state import FRICTION, PushState
from odeform.loads.registry import PUSH, get_load
from odeform.models.base import Predictor
from odeform.models.modal.model import ModalModel
from odeform.simulation.errors import SimulationError
from odeform.types import Frames, Times

__all__ = ["can_simulate", "experiment_simulator", "simulator_of"]


def can_simulate(predictor: Predictor) -> bool:
    """Whether the bodies of a model can be simulated: the scene's objects, or one of which the solid is known."""
    if isinstance(predictor, ModalModel):
        return predictor.solid is not None
    from odeform.simulation.objects.catalog import OBJECTS

    return bool(predictor.schema.objects) and set(predictor.schema.objects) <= set(OBJECTS)


def simulator_of(forward: Forward, name: str | None) -> Callable[[PushState], Frames]:
    """Returns what simulates a state: the surface (T, S, 3) m at the times of `forward`, in five to twenty seconds.

    Raises `InputError` for a body that is neither the scene's object `name` nor one whose solid is known. What is
    returned raises `SimulationError`.
    """
    simulate = experiment_simulator(forward, name)
    return lambda state: simulate(Experiment(PUSH, state.parameters()), state.value(FRICTION), forward.times)


def experiment_simulator(forward: Forward, name: str | None) -> Callable[[Experiment, float, Times], Frames]:
    """Returns what simulates an experiment with a body of some friction: the surface (T, S, 3) m at (T,) s.

    As of `simulator_of`.
    """
    # here, so that a search without simulations does not load the simulator
    from odeform.simulation.objects.catalog import OBJECTS, get_object
    from odeform.simulation.objects.settling import rested
    from odeform.simulation.scenes.contact_force import simulate_object
    from odeform.simulation.scenes.loaded import simulate_load

    solid = forward.model.solid
    if solid is None and name not in OBJECTS:
        raise InputError("identify: expected a body that can be simulated; no solid of this one is known")
    item = rested(solid) if solid is not None else get_object(str(name))

    def simulate(experiment: Experiment, friction: float, times: Times) -> Frames:
        ratio = friction / forward.friction
        rougher = replace(item, material=replace(item.material, friction=ratio * item.material.friction))
        if experiment.load == PUSH:
            try:
                moved = simulate_object(rougher, experiment.parameters)
            except InputError as error:  # the sphere fits beside the body of the model, and not of the simulator
                raise SimulationError(str(error)) from error
        else:
            moved = simulate_load(get_load(experiment.load), rougher, experiment.parameters, until=float(times[-1]))
        return CubicSpline(moved.times, moved.vertices.astype(float))(times)

    return simulate
