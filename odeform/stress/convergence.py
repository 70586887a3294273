"""Whether smaller steps do what they should: errors fall at the order of the method, and never rise against truth."""

from collections.abc import Iterable

import numpy as np

from odeform.dataset.index import Dataset
from odeform.models.odeform.inference import Field, make_field
from odeform.models.odeform.model import ODeform
from odeform.solver.integrate import SolverSettings, integrate
from odeform.solver.method import Method
from odeform.solver.registry import METHODS
from odeform.stress.cases import inside
from odeform.stress.check import Check, Checks
from odeform.types import Floats

__all__ = ["check_orders", "check_refining", "observed_order"]

NODES = 32  # moments at which solutions are compared; each step size divides them
REFINED = (48, 64, 96)  # steps between two of them
SHORT, FINER = 16, (12, 16, 24)  # the part of the window that is looked at in extended precision, and steps there
DOUBLE = 4  # the highest order that shows in double precision
DRAWS = 2
SEQUENCES = 8
STEPS_A_FRAME = (1, 2, 4)
CHANCE = 1.01  # once the solver's error is a fraction of the model's, it adds to it or takes from it


def observed_order(steps: list[float], errors: list[float]) -> float:
    """Slope of log error over log step."""
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


def _order(field: Field, start: Floats, method: Method, span: float) -> float:
    """Of the norm of errors over `NODES` moments.

    Dormand and Prince made the leading term of their error so small that on a sharp field the next one rules until
    rounding in double precision does. Steps small enough, of extended precision, are for a part of the window.
    """
    refined, part = (REFINED, span) if start.dtype == np.float64 else (FINER, span / SHORT)

    def states(name: str, pieces: int) -> Floats:
        solution = integrate(field, start, SolverSettings(name, step=part / pieces), part)
        return np.stack(solution.states[:: pieces // NODES])

    truth = states("dopri5", 2 * NODES * refined[-1])
    errors = [float(np.linalg.norm(states(method.name, NODES * times) - truth)) for times in refined]
    return observed_order([part / (NODES * times) for times in refined], errors)


def check_orders(model: ODeform, seed: int = 0) -> Checks:
    """`order_METHOD_deviation`: how far the observed order is from the method's own, on the model's field."""
    evaluated, schema = model.evaluate_basis(model.rest, 0.0), model.schema
    fields = {dtype: make_field(model.weights, model.config, dtype) for dtype in (np.float64, np.longdouble)}
    off = dict.fromkeys(METHODS, 0.0)
    for parameters in inside(schema, DRAWS, seed):
        theta = schema.inputs(parameters)
        _, start, _ = model.problem(theta, evaluated, np.float64)
        for name, method in METHODS.items():
            dtype = np.float64 if method.order <= DOUBLE else np.longdouble
            found = _order(fields[dtype](theta), start.astype(dtype), method, schema.window.stop)
            off[name] = max(off[name], abs(found - method.order))
    return {f"order_{name}_deviation": Check(value, 0.2) for name, value in off.items()}


def check_refining(model: ODeform, dataset: Dataset) -> Checks:
    """`refining_error_ratio`: the largest ratio of the pooled error against some test sequences to that of the next
    coarser step, from a step a frame on, of any method."""
    window = model.schema.window
    read = (dataset.read(entry).frames(window.stop, window.rate) for entry in dataset.select("test")[:SEQUENCES])
    truths = [(truth.rest, truth) for truth in read]

    def error(quality: SolverSettings) -> float:
        moved = (model.solve(rest, truth.parameters, quality).vertices(truth.times) for rest, truth in truths)
        off = (one - truth.vertices for one, (_, truth) in zip(moved, truths, strict=True))
        return float(np.sqrt(np.mean([np.square(one, dtype=float).mean() for one in off])))

    def ratios(method: str) -> Iterable[float]:
        errors = [error(SolverSettings(method, step=1.0 / (window.rate * steps))) for steps in STEPS_A_FRAME]
        return np.divide(errors[1:], errors[:-1]).tolist()

    return {"refining_error_ratio": Check(max(ratio for name in METHODS for ratio in ratios(name)), CHANCE)}
