"""Physical parameters of an observed motion, estimated jointly, each with an interval."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from odeform.identification.discrepancy import TWO_SIDED, Discrepancy
from odeform.identification.fit import ParameterFit, fit_parameters
from odeform.identification.known import known_discrepancy
from odeform.identification.linear import Comparison
from odeform.identification.observation import Observation
from odeform.models.base import Predictor
from odeform.schema import Parameter
from odeform.types import Floats

__all__ = ["Identification", "Identified", "identify"]


@dataclass(frozen=True)
class Identified:
    """An estimated parameter.

    Attributes:
        value: The estimate, in the parameter's unit.
        low: Lower end of the 90 % interval, within the trained range.
        high: Upper end of that interval.
        identifiable: Whether the interval is narrower than the trained range. If not, the motion does not determine
            the parameter.
        unit: `value` with the trained range mapped to [-1, 1].
        half_width: Half the width of the interval, on the same scale.
    """

    value: float
    low: float
    high: float
    identifiable: bool
    unit: float
    half_width: float


@dataclass(frozen=True)
class Identification:
    """The result of `identify`.

    Attributes:
        parameters: Estimates by name.
        misfit: Mean square residual relative to its expectation; at most 1 where model and noise explain the data.
        seconds: Elapsed time until the estimates were known.
        proposed: Parameters of the next experiment, which would narrow the widest interval most; empty where none was
            asked for.
        narrowed: Half the width that this interval is expected to have afterwards, relative to that it has now.
        simulations: How many simulations of estimates corrected the model.
        stopped: Why no more of them did, if one failed.
        proposed_load: What happens in the proposed experiment: "push", or the name of a load; empty where none was
            asked for.
    """

    parameters: dict[str, Identified]
    misfit: float
    seconds: float
    proposed: dict[str, float] = field(default_factory=dict)
    narrowed: float = 1.0
    simulations: int = 0
    stopped: str = ""
    proposed_load: str = ""


def identify(
    predictor: Predictor,
    observation: Observation,
    discrepancy: Discrepancy | None = None,
    progress: Callable[[dict[str, float]], None] = lambda _: None,
    misfits: Callable[[float], None] = lambda _: None,
) -> Identification:
    """Estimate the parameters of an observed motion, all jointly, each with a 90 % interval. Takes seconds.

    Least squares weigh the noise of the observation and the model's own error (Kennedy & O'Hagan 2001).

    Args:
        predictor: A model of the observed scene, in reduced coordinates (`odeform`, `pod-rbf` or `nearest`).
        observation: N points of the body at T times, in metres and seconds.
        discrepancy: The model's own error, from `calibrate`. By default that of the checkpoint; where it has none, it
            is calibrated on the bundled data set of the scene, which takes seconds to half a minute the first time.
        progress: Called with the parameters after each step; an exception that it raises ends the search.
        misfits: Called just before, with the misfit there (see `Identification`).

    Raises:
        InputError: A model of another kind, or no bundled data set to calibrate on.

    Examples:
        >>> import dataclasses, odeform
        >>> predictor, dataset = odeform.load("mass-elastic"), odeform.open_dataset("mass-elastic")
        >>> few = dataclasses.replace(dataset, entries=dataset.entries[::4])
        >>> discrepancy = odeform.calibrate(predictor, few)
        >>> truth = next(dataset.sequences("test"))
        >>> observation = odeform.Observation(
        ...     rest=truth.vertices[0, ::40], times=truth.times[24::24], positions=truth.vertices[24::24, ::40]
        ... )
        >>> found = odeform.identify(predictor, observation, discrepancy)
        >>> abs(found.parameters["mass"].value - truth.parameters["mass"]) < 0.05
        True
        >>> found.parameters["mass"].identifiable
        True
    """
    begin = time.perf_counter()
    discrepancy = known_discrepancy(predictor) if discrepancy is None else discrepancy

    def report(theta: Floats, misfit: float) -> None:
        misfits(misfit)
        progress({p.name: p.denormalise(float(unit)) for p, unit in zip(predictor.schema.learned, theta, strict=True)})

    found = fit_parameters(Comparison(predictor, observation.subsampled()), discrepancy, report)
    half_widths = _half_widths(found)
    pairs = zip(predictor.schema.learned, found.theta, half_widths, strict=True)
    parameters = {p.name: _identified(p, float(unit), float(half_width)) for p, unit, half_width in pairs}
    return Identification(parameters, found.misfit, time.perf_counter() - begin)


def _half_widths(found: ParameterFit) -> Floats:
    """(P,) half widths of the intervals: from the curvature, and wider where the observation is not explained."""
    size = len(found.theta)
    covariance = np.linalg.inv(found.information + 1e-6 * np.eye(size))
    return TWO_SIDED * np.sqrt(np.diag(covariance) * max(found.misfit, 1.0))


def _identified(parameter: Parameter, unit: float, half_width: float) -> Identified:
    low, high = (parameter.denormalise(float(np.clip(unit + side * half_width, -1.0, 1.0))) for side in (-1.0, 1.0))
    return Identified(parameter.denormalise(unit), low, high, half_width < 1.0, unit, half_width)
