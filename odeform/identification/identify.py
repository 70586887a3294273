"""Physical parameters from an observed motion, all together, each with an interval."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from odeform.identification.discrepancy import TWO_SIDED, Discrepancy
from odeform.identification.fit import ParameterFit, fit_parameters
from odeform.identification.linear import Comparison
from odeform.identification.observation import Observation
from odeform.models.base import Predictor
from odeform.schema import Parameter
from odeform.types import Floats

__all__ = ["Identification", "Identified", "identify"]


@dataclass(frozen=True)
class Identified:
    """One parameter: the estimate, and its 90 % interval within the trained range, in the parameter's unit.

    `identifiable` is False where the interval is as wide as the trained range: the motion then says nothing about the
    parameter. `unit` and `reach` are the estimate and half the interval, with the trained range as [-1, 1].
    """

    value: float
    low: float
    high: float
    identifiable: bool
    unit: float
    reach: float


@dataclass(frozen=True)
class Identification:
    """`parameters` by name; `misfit` is at most 1 if model and noise explain the observation."""

    parameters: dict[str, Identified]
    misfit: float
    seconds: float


def identify(
    predictor: Predictor,
    observation: Observation,
    discrepancy: Discrepancy,
    progress: Callable[[dict[str, float]], None] = lambda _: None,
) -> Identification:
    """Parameters of the motion that was observed, by least squares that weigh noise and the model's own error.

    `discrepancy` comes from `odeform.identification.discrepancy.calibrate`. Takes about a second.
    `progress` is told the parameters after each step; what it raises ends the search.
    """
    begin = time.perf_counter()

    def report(theta: Floats) -> None:
        progress({p.name: p.denormalise(float(unit)) for p, unit in zip(predictor.schema.learned, theta, strict=True)})

    found = fit_parameters(Comparison(predictor, observation.subsampled()), discrepancy, report)
    reaches = _reaches(found)
    pairs = zip(predictor.schema.learned, found.theta, reaches, strict=True)
    parameters = {p.name: _identified(p, float(unit), float(reach)) for p, unit, reach in pairs}
    return Identification(parameters, found.misfit, time.perf_counter() - begin)


def _reaches(found: ParameterFit) -> Floats:
    """(P,) half the intervals: from the curvature, and wider where the observation is not explained."""
    size = len(found.theta)
    covariance = np.linalg.inv(found.information + 1e-6 * np.eye(size))
    return TWO_SIDED * np.sqrt(np.diag(covariance) * max(found.misfit, 1.0))


def _identified(parameter: Parameter, unit: float, reach: float) -> Identified:
    low, high = (parameter.denormalise(float(np.clip(unit + side * reach, -1.0, 1.0))) for side in (-1.0, 1.0))
    return Identified(parameter.denormalise(unit), low, high, reach < 1.0, unit, reach)
