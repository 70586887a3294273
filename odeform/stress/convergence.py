"""Convergence: errors fall with the step at the order of the method, and never rise against the truth."""

from collections.abc import Iterable

import numpy as np

from odeform.dataset.index import Dataset
from odeform.models.latent.inference import make_field
from odeform.models.latent.model import LatentModel
from odeform.models.model import Model
from odeform.solver.integrate import SolverSettings, integrate
from odeform.solver.method import Field, Method
from odeform.solver.registry import METHODS
from odeform.stress.cases import inside, methods_of
from odeform.stress.check import Check, Checks
from odeform.types import Floats

__all__ = ["check_orders", "check_refining", "observed_order"]

NODES = 32  # times at which solutions are compared; each step size divides the intervals
REFINED = (48, 64, 96)  # steps between two of these times
SHORT, FINER = 16, (12, 16, 24)  # in extended precision: the fraction of the window, and the steps
DOUBLE = 4  # the highest order that can be observed in double precision
SAMPLES = 2
SEQUENCES = 8
STEPS_A_FRAME = (1, 2, 4)
CHANCE = 1.01  # a solver error that is a fraction of the model error may add to it or cancel some of it


def observed_order(steps: list[float], errors: list[float]) -> float:
    """Slope of log error over log step."""
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


def _order(field: Field, start: Floats, method: Method, span: float) -> float:
    """Observed order of the norm of errors at `NODES` times.

    The leading error term of Dormand-Prince is so small that on a stiff field the next one dominates until rounding in
    double precision does. Extended precision allows smaller steps, on a part of the window.
    """
    refined, part = (REFINED, span) if start.dtype == np.float64 else (FINER, span / SHORT)

    def states(name: str, pieces: int) -> Floats:
        solution = integrate(field, start, SolverSettings(name, step=part / pieces), part)
        return np.stack(solution.states[:: pieces // NODES])

    truth = states("dopri5", 2 * NODES * refined[-1])
    errors = [float(np.linalg.norm(states(method.name, NODES * times) - truth)) for times in refined]
    return observed_order([part / (NODES * times) for times in refined], errors)


def check_orders(model: LatentModel, seed: int = 0) -> Checks:
    """Returns `order_METHOD_deviation`: difference between the observed order and the method's own, on the model's
    field."""
    evaluated, schema = model.evaluate_basis(model.rest, 0.0), model.schema
    fields = {dtype: make_field(model.weights, model.config, dtype) for dtype in (np.float64, np.longdouble)}
    methods = methods_of(model)
    deviations = dict.fromkeys(methods, 0.0)
    for parameters in inside(schema, SAMPLES, seed):
        theta = schema.inputs(parameters)
        start = model.problem(theta, evaluated, np.float64).start
        for name in methods:
            method = METHODS[name]
            dtype = np.float64 if method.order <= DOUBLE else np.longdouble
            found = _order(fields[dtype](theta), start.astype(dtype), method, schema.window.stop)
            deviations[name] = max(deviations[name], abs(found - method.order))
    return {f"order_{name}_deviation": Check(value, 0.2) for name, value in deviations.items()}


def check_refining(model: Model, dataset: Dataset) -> Checks:
    """`refining_error_ratio`: largest ratio, of any method, between the pooled error on some test sequences and that at
    the next coarser step. The coarsest is one step per frame."""
    window = model.schema.window
    read = (dataset.read(entry).frames(window.stop, window.rate) for entry in dataset.select("test")[:SEQUENCES])
    truths = [(truth.rest, truth) for truth in read]

    def error(quality: SolverSettings) -> float:
        moved = (model.solve(rest, truth.parameters, quality).vertices(truth.times) for rest, truth in truths)
        residuals = (one - truth.vertices for one, (_, truth) in zip(moved, truths, strict=True))
        return float(np.sqrt(np.mean([np.square(one, dtype=float).mean() for one in residuals])))

    def ratios(method: str) -> Iterable[float]:
        errors = [error(SolverSettings(method, step=1.0 / (window.rate * steps))) for steps in STEPS_A_FRAME]
        return np.divide(errors[1:], errors[:-1]).tolist()

    return {"refining_error_ratio": Check(max(ratio for name in methods_of(model) for ratio in ratios(name)), CHANCE)}
