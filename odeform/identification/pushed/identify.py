"""Stiffness, mass and friction of a pushed body, and the place and force of the push, from how its surface moved."""

import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.identification.identify import Identification
from odeform.identification.pushed.candidates import candidates
from odeform.identification.pushed.corrected import Correction, corrected_search
from odeform.identification.pushed.estimates import estimates_of, posterior_of
from odeform.identification.pushed.evidence import Evidence
from odeform.identification.pushed.experiment import Experiment, widest
from odeform.identification.pushed.forward import Forward, pushed_model
from odeform.identification.pushed.search import Found, Problem, search
from odeform.identification.pushed.simulator import experiment_simulator, simulator_of
from odeform.identification.pushed.state import BODY, PUSH_NAMES, PUSH_STEPS, PushState
from odeform.identification.pushed.together import Made, Together, simulated_together
from odeform.loads.registry import PUSH
from odeform.models.base import Predictor
from odeform.models.modal.model import ModalModel
from odeform.schema import OBJECT
from odeform.simulation.contacts import vector_of
from odeform.types import Floats, Frames, Times

__all__ = [
    "PUSHED",
    "WIDENED",
    "identifies_pushes",
    "identify_body",
    "identify_push",
    "model_errors",
    "widening",
]

PUSHED = "push"
"""Contact and force, in lists of what is known."""
CERTAIN = 1e-4
"""Standard deviation of what is known of the body, in halves of its range."""
WIDENED = 7.8
"""Factor on all intervals where the model is wrong by an unknown amount: the conformal one of 20 drawn bodies that the
simulator moved (docs/identification.md). What a model misses looks like another body, from frame to frame alike."""
CORRECTED = 7.1
"""The same where simulations have corrected the model, of 14 bodies."""
CLOUDED = 1.43
"""Factor on intervals of bodies that are seen in clouds and moved in known ways, where the model's error is known: the
conformal one of 14 bodies, each pushed, and pushed and thrown."""


def identify_push(
    predictor: Predictor,
    evidence: Evidence,
    known: Mapping[str, Any] | None = None,
    errors_mm: Times | None = None,
    progress: Callable[[dict[str, float], float], None] = lambda *_: None,
    propose: bool = False,
    simulations: int = 0,
    note: Callable[[str], None] = lambda _: None,
    estimated: Callable[[Identification], None] = lambda _: None,
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
        estimated: Called with the estimates as soon as they are known, before the next experiment is looked for.

    Returns:
        Estimates of `mass`, `young`, `friction`, and of the push where it is not known. A parameter whose interval
        is as wide as its range is not identifiable.

    Raises:
        InputError: A model of another kind, only a part of a push, or a body that cannot be simulated but should be.
    """
    asked = _Asked(errors_mm is None, simulations, propose, progress, note, estimated)
    given = dict(known or {})
    problem, start = _problem(predictor, evidence, given, errors_mm)
    simulate = simulator_of(problem.forward, given.get(OBJECT)) if simulations else None
    found = search(problem, start, asked.step(problem))
    return _identified(predictor, problem, found, given, simulate, asked)


def identify_body(
    predictor: Predictor,
    made: Sequence[Made],
    evidence: Evidence,
    known: Mapping[str, Any] | None = None,
    errors_mm: Times | None = None,
    progress: Callable[[dict[str, float], float], None] = lambda *_: None,
    propose: bool = False,
    simulations: int = 0,
    note: Callable[[str], None] = lambda _: None,
    estimated: Callable[[Identification], None] = lambda _: None,
) -> Identification:
    """Estimate mass, stiffness and friction of a body from several experiments that are known, each with a 90 %
    interval.

    Args:
        predictor: As of `identify_push`.
        made: Pushes, drops and throws of the body, and when it was looked at.
        evidence: Points of the surface at all these times, those of one experiment after those of the one before, seen
            from one place.
        known: The object, and any of `mass` (kg), `young` (kPa) and `friction`.
        errors_mm: (T,) how wrong the model is, as of `identify_push`; by default as the error band says of pushes, and
            as was measured of drops and throws.
        simulations: As of `identify_push`. Where there are falls beside pushes, these are corrected alone at first, and
            again as often with all.
        progress: As of `identify_push`, as are `propose`, `note` and `estimated`.

    Returns:
        Estimates of `mass`, `young` and `friction`.

    Raises:
        InputError: A model of another kind, another load, no experiment, points at other times, or a body that cannot
            be simulated but should be.
    """
    asked = _Asked(errors_mm is None, simulations, propose, progress, note, estimated)
    given = dict(known or {})
    model, named = _model_of(predictor, given)
    if not made:
        raise InputError("identify: expected at least one experiment")
    forward = Together(model, made, named if model.schema.objects else {})
    if not np.array_equal(forward.times, evidence.times):
        raise InputError("identify: expected points at the times of all experiments, one after the other")
    start = forward.state(np.zeros(3), np.zeros(3), _known_body(forward, given))
    errors = _errors_of(predictor, forward, start, named) if errors_mm is None else errors_mm
    free = tuple(index for index, name in enumerate(BODY) if name not in given)
    problem, found, simulate = Problem(forward, evidence, errors, free), None, None
    if simulations:
        simulate_one = experiment_simulator(forward, given.get(OBJECT))
        simulate = simulated_together(forward, simulate_one)
        found = _by_pushes(problem, forward, start, simulate_one, asked)
    return _identified(predictor, problem, found or search(problem, start, asked.step(problem)), given, simulate, asked)


@dataclass(frozen=True)
class _Asked:
    """What is asked of a search, and who is told."""

    unknown: bool
    """Whether nobody says by how much the model is wrong."""
    simulations: int
    propose: bool
    progress: Callable[[dict[str, float], float], None]
    note: Callable[[str], None]
    estimated: Callable[[Identification], None]
    begin: float = field(default_factory=time.perf_counter)

    def step(self, problem: Problem) -> Callable[[PushState, float], None]:
        """What tells of a step."""
        names = [*BODY, *(PUSH_NAMES if len(BODY) in problem.free else ())]

        def report(state: PushState, misfit: float) -> None:
            every = {**{name: state.value(name) for name in BODY}, **state.parameters()}
            self.progress({name: every[name] for name in names}, misfit)

        return report


def _by_pushes(
    problem: Problem,
    forward: Together,
    start: PushState,
    simulate: Callable[[Experiment, float, Times], Frames],
    asked: _Asked,
) -> Found | None:
    """What the pushes say alone, with simulations that correct the model; None where there are no falls beside them.

    Where bodies land decides about all that follows, so that slopes of falls are right only near the body, and lead
    astray from far away.
    """
    pushes = [one for one in forward.made if one.experiment.load == PUSH]
    if not 0 < len(pushes) < len(forward.made):
        return None
    kept = np.concatenate([np.full(len(one.times), one.experiment.load == PUSH) for one in forward.made])
    alone = Together(forward.model, pushes, forward.named)
    part = Problem(alone, problem.evidence.at(kept), problem.errors_mm[kept], problem.free)
    step, moved = asked.step(part), simulated_together(alone, simulate)

    def note(text: str) -> None:
        asked.note(f"By the pushes alone, at first. {text}")

    return corrected_search(part, search(part, start, step), moved, asked.simulations, step, note).found


def _identified(
    predictor: Predictor,
    problem: Problem,
    found: Found,
    given: dict[str, Any],
    simulate: Callable[[PushState], Frames] | None,
    asked: _Asked,
) -> Identification:
    """Corrects the model by what simulates it, estimates, and proposes."""
    correction = Correction(problem, found, np.zeros(0), 0)
    if simulate is not None:
        correction = corrected_search(problem, found, simulate, asked.simulations, asked.step(problem), asked.note)
        found = correction.found
    corrected = correction.simulations > 0
    widened = widening(problem, corrected, asked.unknown)
    estimates = estimates_of(correction.problem, found, widened, correction.last if corrected else None)
    out = Identification(
        estimates,
        found.misfit,
        time.perf_counter() - asked.begin,
        simulations=correction.simulations,
        stopped=correction.stopped,
    )
    if not asked.propose or set(problem.free).isdisjoint(range(len(BODY))):
        return out
    asked.estimated(out)
    asked.note("Looking for the experiment that would tell most next")
    posterior = posterior_of(correction.problem, found)[0]
    # what corrects these experiments says nothing of others
    proposed, narrowed = _proposed(predictor, problem, found.state, posterior, given)
    return replace(out, proposed=dict(proposed.parameters), narrowed=narrowed, proposed_load=proposed.load)


def widening(problem: Problem, corrected: bool, unknown: bool) -> float:
    """By how much intervals are widened; `unknown` is by how much the model is wrong, unless it was `corrected`."""
    if corrected or unknown:
        return CORRECTED if corrected else WIDENED
    return CLOUDED if problem.camera_free and len(BODY) not in problem.free else 1.0


def identifies_pushes(predictor: Predictor) -> bool:
    """Whether `identify_push` knows a model: a mechanical one of pushed bodies that have a mass and a stiffness."""
    first = {OBJECT: predictor.schema.objects[0]} if predictor.schema.objects else {}
    return pushed_model(predictor, first) is not None


def model_errors(predictor: Predictor, given: Mapping[str, Any], times: Times) -> Times:
    """(T,) mm: how wrong a model is about its own body, by its error band; zero where it has none."""
    band = predictor.error_band(predictor.complete(given), np.maximum(times, 1e-9))
    return np.zeros(len(times)) if band is None else band.mean(axis=1)


def _model_of(predictor: Predictor, given: Mapping[str, Any]) -> tuple[ModalModel, dict[str, Any]]:
    """The model of the body that `given` selects, and the parameters that select it."""
    named = {name: value for name, value in given.items() if isinstance(value, str)}
    named = named or dict(getattr(predictor, "parameters_like", dict)())
    model = pushed_model(predictor, named)
    if model is None:
        raise InputError(f"identify: expected a mechanical model of pushed bodies, got {predictor.model}")
    return model, named


def _known_body(forward: Forward, given: Mapping[str, Any]) -> Floats:
    """(3,) what is known of the body, in [-1, 1], and the middle of the range for the rest."""
    body = np.array([r.normalise(float(given[r.name])) if r.name in given else 0.0 for r in forward.ranges])
    if np.abs(body).max() > 1.0 + 1e-6:
        raise InputError("identify: a value that is known lies outside of half to twice the body's own")
    return np.clip(body, -1.0, 1.0)


def _problem(
    predictor: Predictor, evidence: Evidence, given: dict[str, Any], errors_mm: Times | None
) -> tuple[Problem, PushState]:
    model, named = _model_of(predictor, given)
    if errors_mm is None:
        errors_mm = model_errors(predictor, named, evidence.times)
    forward = Forward(model, evidence.times, named if model.schema.objects else {})
    complete = predictor.complete({**named, **{k: v for k, v in given.items() if k in predictor.schema.names}})
    vectors = [vector_of(complete, kind) for kind in ("contact", "force")]
    strongest = predictor.force_range(complete)[1]
    state = forward.state(*vectors, body=_known_body(forward, given), strongest=strongest)
    return Problem(forward, evidence, errors_mm, _free(given)), state


def _errors_of(predictor: Predictor, forward: Together, start: PushState, named: Mapping[str, Any]) -> Times:
    """(T,) mm: how wrong the model is in all experiments."""
    pairs = zip(forward.made, forward.parts(start), strict=True)
    return np.concatenate(
        [
            model_errors(predictor, named, one.times) if one.experiment.load == PUSH else forward.fall_errors(moved)
            for one, moved in pairs
        ]
    )


def _free(given: Collection[str]) -> tuple[int, ...]:
    body = [index for index, name in enumerate(BODY) if name not in given]
    parts = set(PUSH_NAMES)
    if parts & set(given) and not parts <= set(given):
        raise InputError("identify: expected the whole push to be known, contact and force, or nothing of it")
    return (*body, *(() if parts <= set(given) else range(len(BODY), len(BODY) + PUSH_STEPS)))


def _proposed(
    predictor: Predictor, problem: Problem, state: PushState, posterior: Floats, given: dict[str, Any]
) -> tuple[Experiment, float]:
    """The experiment that narrows the widest interval of the body most, and to which fraction.

    The covariance `posterior` (F, F) is that of what is unknown of the estimate `state`.
    """
    covariance = CERTAIN**2 * np.eye(len(BODY))
    open_ = [index for index in problem.free if index < len(BODY)]
    covariance[np.ix_(open_, open_)] = posterior[: len(open_), : len(open_)]
    forward, errors = problem.forward, problem.errors_mm
    if isinstance(forward, Together):
        forward = Forward(forward.model, forward.model.schema.window.times, forward.named)
        errors = model_errors(predictor, forward.named, forward.times)
    forces = predictor.force_range(given)
    tried = candidates(forward, state.body, forces, problem.evidence.noise_mm, errors)
    best = tried.best(covariance)
    return tried.experiments[best], widest(tried.after(covariance, best)) / widest(covariance)
