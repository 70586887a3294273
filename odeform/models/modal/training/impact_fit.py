"""Fits how a body meets the floor to simulated motions under loads: throws, for instance."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from odeform.loads.load import Load
from odeform.loads.registry import first_body
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.models.modal.model import QUALITIES, ModalModel
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.reduced_motion import moved_points, placements
from odeform.schema import Parameters
from odeform.types import Floats, Frames, MotionSequence, Perpoint, Times

__all__ = ["FITTED", "FRAMES", "Impact", "first_contact", "impact_fit", "impacts_of", "predicted"]

FITTED = {
    "static_penetration": 0.01,
    "floor_damping": 0.01,
    "floor_friction": 0.1,
    "floor_regularisation": 0.02,
    "stiffness": 0.3,
    "damping": 0.1,
}
"""Contact parameters that are fitted, and how firmly each stays near where it began: what a factor e costs, relative to
motions that are as wrong as they are large."""
START = {"floor_damping": 3e-3}  # s: without its force before contact, the floor damps less
FRAMES = 12  # after the first contact, that are fitted
TOUCHES = 5e-4  # m above the floor or before an obstacle, from which on a body counts as landed
EVERY = 7  # of the vertices, one is looked at
STEP, EVALUATIONS = 0.03, 10  # of the logarithms, for differences; of the Jacobian


@dataclass(frozen=True, eq=False)
class Impact:
    """One simulated motion of S vertices at T times, from the frame of its first contact on."""

    parameters: Parameters
    times: Times
    vertices: Frames
    weights: Perpoint
    first: int
    """Index of the frame of the first contact; 0 of a body that begins on the floor, or is held."""

    def size(self, frames: int) -> float:
        """RMS displacement in m since the first contact, over that many frames and one."""
        part = self.vertices[self.first : self.first + frames + 1]
        return float(np.sqrt((((part - part[0]) ** 2).sum(axis=2) @ self.weights).mean()))


def impacts_of(sequences: Iterable[MotionSequence], rate: float, load: Load) -> list[Impact]:
    """The motions of a data set under a load, at `rate` Hz."""
    found = []
    for sequence in sequences:
        known = sequence.frames(float(sequence.times[-1]), rate)
        vertices = known.vertices.astype(float)
        first = 0 if load.held else first_contact(vertices, load, sequence.parameters)
        found.append(Impact(sequence.parameters, known.times, vertices, sequence.weights, first))
    return found


def first_contact(vertices: Frames, load: Load, parameters: Parameters) -> int:
    """The frame of a motion (T, S, 3) m in which a body that flies touches something; of two, the one that stands has
    then begun to move. The first one, if none does."""
    first = first_body(load.scene, vertices.shape[1])
    thrown, other = vertices[:, first], vertices[:, first.stop :]
    gaps = [thrown[:, :, 2], *(one.met(thrown)[0] for one in load.obstacles(parameters))]
    touches = np.min(gaps, axis=(0, 2)) < TOUCHES
    if other.shape[1]:
        touches |= np.abs(other - other[0]).max(axis=(1, 2)) > TOUCHES
    return int(touches.argmax())


def predicted(model: ModalModel, impact: Impact, evaluated: EvaluatedBasis, frames: int) -> Frames:
    """(T, S, 3) m: what a model under a load says of an impact, that many frames after the first contact, and one."""
    times = impact.times[impact.first : impact.first + frames + 1]
    if model.load is not None and model.load.pairs:
        return model.solve(parameters=impact.parameters).vertices(times).astype(float)
    body = model.changed(impact.parameters)
    solved = body.integrate(body.inputs(impact.parameters), evaluated, QUALITIES["balanced"], float(times[-1]))
    y = solved.reduced(times)
    out = moved_points(evaluated, y, *placements(body.space, y, 0.0)).astype(float)
    if (ground := body.ground_of(impact.parameters)) is not None:
        ground.keep_out(out, evaluated.sides)
    return out


def impact_fit(known: Sequence[tuple[ModalModel, Sequence[Impact]]]) -> ContactParameters:
    """The contact parameters under which models of one body, each under the load of its impacts, follow these best over
    the first 120 ms after contact; each counts by its error relative to its size."""
    model = known[0][0]
    evaluated, given = model.evaluate_basis(model.rest, 0.0), model.contact_parameters
    centre = np.log([getattr(given, name) for name in FITTED])
    start = np.log([START[name] if name in START else getattr(given, name) for name in FITTED])
    firm = np.array(list(FITTED.values()))

    def parameters(x: Floats) -> ContactParameters:
        return replace(given, **dict(zip(FITTED, np.exp(x).tolist(), strict=True)))

    def residuals(x: Floats) -> Floats:
        trials = [(one.with_contact_parameters(parameters(x)), impacts) for one, impacts in known]
        found = [_residual(trial, impact, evaluated) for trial, impacts in trials for impact in impacts]
        return np.concatenate([firm * (x - centre), *found])

    found = least_squares(residuals, start, diff_step=STEP, max_nfev=EVALUATIONS, x_scale=np.full(len(start), 0.5))
    return parameters(found.x)


def _residual(model: ModalModel, impact: Impact, evaluated: EvaluatedBasis) -> Floats:
    """Its squares sum to the squared error, relative to the size of the motion; a failed motion counts as that size."""
    truth = impact.vertices[impact.first : impact.first + FRAMES + 1, ::EVERY]
    off = predicted(model, impact, evaluated, FRAMES)[:, ::EVERY] - truth
    weights = impact.weights[::EVERY]
    scaled = off * np.sqrt(weights / weights.sum() / len(truth))[:, None] / impact.size(FRAMES)
    return np.nan_to_num(scaled, nan=1.0, posinf=1.0, neginf=-1.0).ravel()
