"""Stiffness, mass and friction of a pushed body, and the place and force of the push, from how its surface moved."""

import time
from collections.abc import Callable, Collection, Mapping
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.identification.discrepancy import TWO_SIDED
from odeform.identification.identify import Identification, Identified
from odeform.identification.pushed.candidates import candidates
from odeform.identification.pushed.corrected import Correction, corrected_search
from odeform.identification.pushed.evidence import Evidence, Known
from odeform.identification.pushed.experiment import Experiment, widest
from odeform.identification.pushed.forward import Forward, pushed_model
from odeform.identification.pushed.search import Found, Problem, search
from odeform.identification.pushed.simulator import simulator_of
from odeform.identification.pushed.state import BODY, PUSH, PushState
from odeform.identification.pushed.views import points_of, window_of
from odeform.models.base import Predictor
from odeform.schema import OBJECT
from odeform.types import Floats, MotionSequence, Times

__all__ = [
    "PUSHED",
    "PUSH_NAMES",
    "WIDENED",
    "identifies_pushes",
    "identify_push",
    "model_errors",
    "posterior_of",
    "recorded_points",
]

PUSHED = "push"
"""Contact and force, in lists of what is known."""
PUSH_NAMES = tuple(f"{kind}_{axis}" for kind in ("contact", "force") for axis in "xyz")
CERTAIN = 1e-4
"""Standard deviation of what is known of the body, in halves of its range."""
WIDENED = 7.8
"""Factor on all intervals where the model is wrong by an unknown amount: the conformal one of 20 drawn bodies that the
simulator moved (docs/identification.md). What a model misses looks like another body, from frame to frame alike."""
CORRECTED = 7.1
"""The same where simulations have corrected the model, of 14 bodies."""


def identify_push(
    predictor: Predictor,
    evidence: Evidence,
    known: Mapping[str, Any] | None = None,
    errors_mm: Times | None = None,
    progress: Callable[[dict[str, float], float], None] = lambda *_: None,
    propose: bool = False,
    simulations: int = 0,
    note: Callable[[str], None] = lambda _: None,
) -> Identification:
    """Estimate how a pushed body is made and how it was pushed, all jointly, each with a 90 % interval.

    Args:
        predictor: A modal model: `contact-force`, one that was trained like it, or that of a user's body.
        evidence: Points of the surface over time, with correspondence (`Known`) or without (`Cloud`).
        known: Parameters that are known: the object, and any of `mass` (kg), `young` (kPa), `friction`, and the whole
            push (`contact_x` to `contact_z` in m, `force_x` to `force_z` in N).
        errors_mm: (T,) how wrong the model is at the times of the evidence, by errors that are independent from frame
            to frame; by default as its error band says, and intervals are widened by what bodies in the simulator took.
        progress: Called with the parameters and the misfit before each step; an exception that it raises ends it.
        propose: Whether to look for the push, drop or throw that would tell most next.
        simulations: How often at most to simulate the estimate, to correct the model by what it misses there, and to
            estimate again: some ten seconds each.
        note: Called with what is done, before each simulation and before experiments are compared.

    Returns:
        Estimates of `mass`, `young`, `friction`, and of the push where it is not known. A parameter whose interval
        is as wide as its range is not identifiable.

    Raises:
        InputError: A model of another kind, only a part of a push, or a body that cannot be simulated but should be.
    """
    begin = time.perf_counter()
    given = dict(known or {})
    problem, start = _problem(predictor, evidence, given, errors_mm)

    def report(state: PushState, misfit: float) -> None:
        progress(_values(state), misfit)

    simulate = simulator_of(problem.forward, given.get(OBJECT)) if simulations else None
    found = search(problem, start, report)
    correction = Correction(problem, found, np.zeros(0), 0)
    if simulate is not None:
        correction = corrected_search(problem, found, simulate, simulations, report, note)
        problem, found = correction.problem, correction.found
    corrected = correction.simulations > 0
    widened = CORRECTED if corrected else WIDENED if errors_mm is None else 1.0
    estimates = _identified(problem, found, widened, correction.last if corrected else None)
    proposed, narrowed = Experiment("", {}), 1.0
    if propose and set(problem.free) & set(range(len(BODY))):
        note("Looking for the experiment that would tell most next")
        proposed, narrowed = _proposed(problem, found, predictor.force_range(given))
    seconds = time.perf_counter() - begin
    came_to = correction.simulations, correction.stopped
    return Identification(
        estimates, found.misfit, seconds, dict(proposed.parameters), narrowed, *came_to, proposed_load=proposed.load
    )


def identifies_pushes(predictor: Predictor) -> bool:
    """Whether `identify_push` knows a model: a mechanical one of pushed bodies that have a mass and a stiffness."""
    named = dict(getattr(predictor, "parameters_like", dict)())
    first = {OBJECT: predictor.schema.objects[0]} if predictor.schema.objects else {}
    return pushed_model(predictor, named or first) is not None


def recorded_points(predictor: Predictor, recorded: MotionSequence, named: Mapping[str, Any]) -> Known:
    """Observes a recorded motion of the body that `named` selects. `InputError` where it is one of another surface."""
    model = pushed_model(predictor, named)
    if model is None or not np.array_equal(recorded.faces, model.rest.faces):
        raise InputError("identify: expected a motion of the body that the model knows, vertex by vertex")
    times, surface = window_of(recorded, model.schema.window.stop, model.schema.window.rate)
    return points_of(times, surface, recorded.faces)


def model_errors(predictor: Predictor, given: Mapping[str, Any], times: Times) -> Times:
    """(T,) mm: how wrong a model is about its own body, by its error band; zero where it has none."""
    band = predictor.error_band(predictor.complete(given), np.maximum(times, 1e-9))
    return np.zeros(len(times)) if band is None else band.mean(axis=1)


def _problem(
    predictor: Predictor, evidence: Evidence, given: dict[str, Any], errors_mm: Times | None
) -> tuple[Problem, PushState]:
    named = {name: value for name, value in given.items() if isinstance(value, str)}
    named = named or dict(getattr(predictor, "parameters_like", dict)())
    model = pushed_model(predictor, named)
    if model is None:
        raise InputError(f"identify: expected a mechanical model of pushed bodies, got {predictor.model}")
    if errors_mm is None:
        errors_mm = model_errors(predictor, named, evidence.times)
    forward = Forward(model, evidence.times, named if model.schema.objects else {})
    complete = predictor.complete({**named, **{k: v for k, v in given.items() if k in predictor.schema.names}})
    vectors = [np.array([complete[f"{kind}_{axis}"] for axis in "xyz"]) for kind in ("contact", "force")]
    strongest = predictor.force_range(complete)[1]
    body = np.array([r.normalise(float(given[r.name])) if r.name in given else 0.0 for r in forward.ranges])
    if np.abs(body).max() > 1.0 + 1e-6:
        raise InputError("identify: a value that is known lies outside of half to twice the body's own")
    state = forward.state(*vectors, body=np.clip(body, -1.0, 1.0), strongest=strongest)
    return Problem(forward, evidence, errors_mm, _free(given)), state


def _free(given: Collection[str]) -> tuple[int, ...]:
    body = [index for index, name in enumerate(BODY) if name not in given]
    parts = set(PUSH_NAMES)
    if parts & set(given) and not parts <= set(given):
        raise InputError("identify: expected the whole push to be known, contact and force, or nothing of it")
    return (*body, *(() if parts <= set(given) else range(len(BODY), len(BODY) + PUSH)))


def _proposed(problem: Problem, found: Found, forces: tuple[float, float]) -> tuple[Experiment, float]:
    """The experiment that narrows the widest interval of the body most, and to which fraction."""
    covariance = CERTAIN**2 * np.eye(len(BODY))
    open_ = [index for index in problem.free if index < len(BODY)]
    posterior = posterior_of(problem, found)[0]
    covariance[np.ix_(open_, open_)] = posterior[: len(open_), : len(open_)]
    noise_mm, errors = problem.evidence.noise_mm, problem.errors_mm
    tried = candidates(problem.forward, found.state.body, forces, noise_mm, errors)
    best = tried.best(covariance)
    return tried.experiments[best], widest(tried.after(covariance, best)) / widest(covariance)


def _values(state: PushState) -> dict[str, float]:
    return {**{name: state.value(name) for name in BODY}, **state.parameters()}


def posterior_of(problem: Problem, found: Found) -> tuple[Floats, Floats]:
    """Covariances (F, F) of what is unknown but the camera: with the prior, and of the observation alone."""
    size, scale = len(problem.free), max(found.misfit, 1.0)
    information = found.information / scale
    with_prior = np.linalg.inv(information + np.diag(problem.precision()))
    alone = np.linalg.inv(information + 1e-6 * np.eye(len(information)))
    return with_prior[:size, :size], alone[:size, :size]


def _identified(problem: Problem, found: Found, widened: float, last: Floats | None) -> dict[str, Identified]:
    """Estimates, with intervals that are `widened` times as wide as those of the posterior, to which the `last` step of
    the estimate (9,) adds, if simulations corrected it."""
    state, free = found.state, list(problem.free)
    step = np.zeros(len(free)) if last is None else _in_steps(state, last)[free]
    posterior, alone = (
        widened**2 * (covariance + np.outer(step, step) / TWO_SIDED**2) for covariance in posterior_of(problem, found)
    )
    out: dict[str, Identified] = {}
    for index, name in enumerate(BODY):
        if index in free:
            at = free.index(index)
            half = TWO_SIDED * float(np.sqrt(posterior[at, at]))
            narrow = TWO_SIDED * float(np.sqrt(alone[at, at])) < 1.0
            unit, parameter = float(state.body[index]), problem.forward.ranges[index]
            low, high = (parameter.denormalise(float(np.clip(unit + side * half, -1.0, 1.0))) for side in (-1.0, 1.0))
            out[name] = Identified(parameter.denormalise(unit), low, high, narrow, unit, half)
    if len(BODY) in free:
        first = free.index(len(BODY))
        parts = (
            ("contact", state.contact, slice(first, first + 2), state.size * state.tangents, state.size),
            ("force", state.force, slice(first + 2, first + PUSH), state.strongest * np.eye(3), state.strongest),
        )
        for kind, vector, rows, span, scale in parts:
            wide, narrow = (span.T @ covariance[rows, rows] @ span for covariance in (alone, posterior))
            out |= _vector(kind, vector, narrow, wide, scale)
    return out


def _in_steps(state: PushState, vector: Floats) -> Floats:
    """(9,) a difference of `PushState.vector` -> (8,) the step of `PushState.stepped` along it."""
    body, contact, force = np.split(vector, [len(BODY), len(BODY) + 3])
    return np.concatenate([body, state.tangents @ contact, force])


def _vector(kind: str, value: Floats, covariance: Floats, alone: Floats, scale: float) -> dict[str, Identified]:
    """Three estimates, of which `scale` is half of the range."""
    out = {}
    for axis, x, variance, wide in zip("xyz", value, np.diag(covariance), np.diag(alone), strict=True):
        half = TWO_SIDED * float(np.sqrt(variance))
        narrow = TWO_SIDED * float(np.sqrt(wide)) < scale
        x = float(x)
        out[f"{kind}_{axis}"] = Identified(x, x - half, x + half, narrow, x / scale, half / scale)
    return out
