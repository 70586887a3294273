"""Finds the push and the body that explain an observation best: draws are compared, the best are refined."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree
from threadpoolctl import threadpool_limits

from odeform.errors import InputError
from odeform.identification.pushed.evidence import Cloud, Evidence, Known, Residuals
from odeform.identification.pushed.forward import Forward
from odeform.identification.pushed.registration import cameras_of
from odeform.identification.pushed.state import BODY, POSE, PUSH_STEPS, Camera, PushState
from odeform.simulation.contact_draws import contact_draws
from odeform.types import Floats, Frames, Ints

__all__ = ["PRIOR", "Found", "Problem", "information_of", "misfit_of", "refined", "search"]

PRIOR = 0.58
"""Standard deviation of each of `BODY` before anything is seen: that of a uniform draw from [-1, 1]."""
FORCE_PRIOR = 1.0  # of each component, in strongest forces
DRAWS, COMPARED = 128, 5  # pushes that are tried, and frames on which
BODIES = 24  # that are tried where the push is known
CAMERAS = 6  # places of the camera; a round body looks alike from many, and each is tried with all pushes
TRIED, BRIEF, REFINED = (
    8,
    2,
    3,
)  # starts that are refined briefly, for so many rounds, and starts that are refined fully
APART = 0.3  # half extents between two places that are tried
ROUNDS, CLOSE = 12, 1e-2  # squared standard deviations: converged if an undamped step is shorter
DAMPING = (1e-2, 0.2, 6.0)  # initially; factor after an accepted step; after a rejected one
LARGEST = 1e5
EXPLAINED = 1.1
"""Misfit below which no other start is tried: in a cloud, wrong places often have no more than 1.3."""
FLOOR_MM = 0.02  # error that is never below rounding


@dataclass(frozen=True, eq=False)
class Problem:
    """What is searched, and how errors of the model are weighed."""

    forward: Forward
    evidence: Evidence
    errors_mm: Float[np.ndarray, " times"]
    """(T,) RMS displacement by which the model is wrong, as if errors of frames were independent."""
    free: tuple[int, ...]
    """Which of the steps of `PushState.stepped` are unknown."""

    @property
    def camera_free(self) -> bool:
        """Whether the camera is unknown as well."""
        return self.evidence.camera_free

    def precision(self) -> Floats:
        """(F + C,) of the prior."""
        every = np.concatenate([np.full(3, PRIOR**-2), np.full(2, 1e-2), np.full(3, FORCE_PRIOR**-2)])
        return np.concatenate([every[list(self.free)], np.full(POSE if self.camera_free else 0, 1e-6)])

    def departure(self, state: PushState) -> Floats:
        """(F + C,) from the middle of the prior, in its units."""
        every = np.concatenate([state.body, np.zeros(2), state.force / state.strongest])
        return np.concatenate([every[list(self.free)], np.zeros(POSE if self.camera_free else 0)])


@dataclass(frozen=True, eq=False)
class Found:
    """The best state, the Fisher `information` (F + C, F + C) there without the prior, and the misfit."""

    state: PushState
    information: Floats
    misfit: float
    converged: bool


@dataclass(frozen=True, eq=False)
class _Equations:
    information: Floats
    score: Floats
    cost: float
    count: int


def _weighted(problem: Problem, frame: int, causes: Floats, columns: Floats) -> Floats:
    """Applies the inverse covariance of a frame's residuals (R,), in mm^-2, to `columns` (R, M).

    The covariance is diagonal but for the `causes` (R, 6): a wrong model shifts, turns and bends a body alike.
    """
    error = problem.errors_mm[frame] ** 2
    alone = problem.evidence.noise_mm**2 + FLOOR_MM**2 + error / 9.0
    if error == 0.0:
        return columns / alone
    inner = np.eye(causes.shape[1]) * (6.0 * alone / error) + causes.T @ causes
    return (columns - causes @ np.linalg.solve(inner, causes.T @ columns)) / alone


def _equations(problem: Problem, state: PushState) -> _Equations:
    compared = problem.evidence.compared(*problem.forward.jet(state, problem.free), state.camera)
    count = sum(len(values) for values in compared.values)
    return _Equations(*information_of(problem, compared), count)


def misfit_of(problem: Problem, state: PushState, surface: Frames) -> float:
    """Returns the weighted sum of squares of a surface (T, S, 3) m, seen by the camera of a state, with the prior."""
    compared = problem.evidence.compared(surface, np.zeros((1, *surface.shape)), state.camera)
    return information_of(problem, compared)[2] + _prior_cost(problem, state)


def information_of(problem: Problem, compared: Residuals) -> tuple[Floats, Floats, float]:
    """Returns the Fisher information (F + C, F + C), the score (F + C,) and the weighted sum of squares."""
    size = len(compared.slopes[0])
    information, score, cost = np.zeros((size, size)), np.zeros(size), 0.0
    frames = zip(compared.values, compared.slopes, compared.causes, strict=True)
    for frame, (values, rows, causes) in enumerate(frames):
        weighted = _weighted(problem, frame, causes, np.concatenate([rows, values[None]]).T)
        information += rows @ weighted[:, :-1]
        score += rows @ weighted[:, -1]
        cost += float(values @ weighted[:, -1])
    return information, score, cost


def _prior_cost(problem: Problem, state: PushState) -> float:
    return float((problem.precision() * problem.departure(state) ** 2).sum())


def _moved(problem: Problem, state: PushState, step: Floats) -> PushState:
    every = np.zeros(len(BODY) + PUSH_STEPS)
    every[list(problem.free)] = step[: len(problem.free)]
    out = state.stepped(every)
    if problem.camera_free:
        about = np.asarray(problem.forward.model.rest.points, dtype=float).mean(axis=0)
        out = replace(out, camera=state.camera.moved(step[len(problem.free) :], about))
    return out


def refined(
    problem: Problem, state: PushState, progress: Callable[[PushState, float], None], rounds: int = ROUNDS
) -> Found:
    """Levenberg-Marquardt with the prior, from one start."""
    precision = np.diag(problem.precision())
    now, damping, converged = _equations(problem, state), DAMPING[0], False
    total = now.cost + _prior_cost(problem, state)
    for _ in range(rounds):
        progress(state, now.cost / now.count)
        matrix = now.information + precision
        pulled = now.score - precision @ problem.departure(state)
        undamped = np.linalg.solve(matrix, pulled)
        converged = bool(undamped @ matrix @ undamped < CLOSE)
        if converged or damping > LARGEST:
            break
        step = np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), pulled)
        moved, cost = _tried(problem, state, step)
        if moved is not None and cost < total:
            small = total - cost < 1e-3 * max(total, 1.0) and damping <= DAMPING[0]
            state, total, damping = moved, cost, damping * DAMPING[1]
            now = _equations(problem, state)
            converged = small
            if small:
                break
        else:
            damping *= DAMPING[2]
    return Found(state, now.information, now.cost / now.count, converged)


def _tried(problem: Problem, state: PushState, step: Floats) -> tuple[PushState | None, float]:
    """The state after a step, halved until a sphere can push there, and its cost; None where none is found."""
    for half in (1.0, 0.5, 0.25):
        try:
            moved = _moved(problem, state, half * step)
            problem.forward.check(moved)
        except InputError:
            continue
        return moved, misfit_of(problem, moved, problem.forward.motions([moved])[0])
    return None, np.inf


def search(problem: Problem, start: PushState, progress: Callable[[PushState, float], None] = lambda *_: None) -> Found:
    """Compares drawn pushes, if the push is unknown, or bodies, if the camera is; refines the best briefly, by the push
    if it is unknown, and all that is unknown of those that are best then, until one explains the observation."""
    found: list[Found] = []
    with threadpool_limits(1):  # products are small
        starts = _apart(_starts(problem, start))[:TRIED]
        if len(starts) > REFINED:
            # starts differ by their pushes, or, where the push is known, only by the camera, which is always refined
            first = tuple(index for index in problem.free if index >= len(BODY)) or problem.free
            brief = [refined(replace(problem, free=first), state, progress, BRIEF) for state in starts]
            starts = [one.state for one in sorted(brief, key=lambda one: one.misfit)]
        for state in starts[:REFINED]:
            found.append(refined(problem, state, progress))
            # under noise, places that are wrong explain a cloud nearly as well
            if found[-1].misfit < EXPLAINED and len(found) >= (2 if problem.camera_free else 1):
                break
    return min(found, key=lambda one: one.misfit)


def _apart(states: list[PushState]) -> list[PushState]:
    """Those that push elsewhere than all before, or are seen by another camera."""
    kept: list[PushState] = []
    for state in states:
        near = [one for one in kept if one.camera is state.camera]
        if all(np.linalg.norm(one.contact - state.contact) > APART * state.size for one in near):
            kept.append(state)
    return kept


def _starts(problem: Problem, start: PushState) -> list[PushState]:
    """The start as it is, where only the body is unknown; pushes that are drawn, or bodies where the camera is unknown,
    the nearest first."""
    cameras = [start.camera]
    if isinstance(problem.evidence, Cloud) and problem.camera_free:
        cameras = cameras_of(problem.evidence.points[0], problem.forward.model.rest, CAMERAS)
    frames = np.unique(np.linspace(0, len(problem.evidence.times) - 1, COMPARED).round().astype(int))
    if not set(problem.free).isdisjoint(range(len(BODY), len(BODY) + PUSH_STEPS)):
        drawn = contact_draws(problem.forward.model.rest, (0.2 * start.strongest, start.strongest), DRAWS, [0])
        states = [replace(start, contact=contact, force=force) for contact, force in drawn]
        surfaces = problem.forward.motions(states)[:, frames]
    elif problem.camera_free:
        # another body moves so differently that its cloud is matched with wrong faces, from which no slope leads back
        states = [start, *_bodies(problem, start)]
        surfaces = [problem.forward.motions([state])[0, frames] for state in states]
    else:
        return [start]
    ranked = []
    for camera in cameras:
        for state, surface in zip(states, surfaces, strict=True):
            ranked.append((_distance(problem.evidence, surface, frames, camera), replace(state, camera=camera)))
    return [state for _, state in sorted(ranked, key=lambda one: one[0])]


def _bodies(problem: Problem, start: PushState) -> list[PushState]:
    """Bodies all over the ranges of what is unknown of them."""
    free = [index for index in problem.free if index < len(BODY)]
    found = []
    for row in np.random.default_rng(0).uniform(-1.0, 1.0, (BODIES, len(free))):
        body = start.body.copy()
        body[free] = row
        state = replace(start, body=body)
        try:
            problem.forward.check(state)
        except InputError:
            continue
        found.append(state)
    return found


def _distance(evidence: Evidence, surface: Floats, frames: Ints, camera: Camera) -> float:
    """m^2 between an observation and a surface at some frames."""
    if isinstance(evidence, Known):
        known = np.einsum("nc,tnci->tni", evidence.barycentric, surface[:, evidence.faces[evidence.face]])
        return float(((known - evidence.positions[frames]) ** 2).mean())
    assert isinstance(evidence, Cloud)
    away = [
        KDTree(there).query(camera.points(evidence.points[frame]))[0]
        for frame, there in zip(frames, surface, strict=True)
    ]
    return float(np.mean([(row**2).mean() for row in away]))
