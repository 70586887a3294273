"""A predicted motion near some parameters, held against an observation.

What a point is off by has few causes: the body is shifted, turned, or deformed in its modes. These `causes` are 6 + K
numbers a frame, each in millimetres of RMS displacement over the body. Both a change of the parameters and the error of
a model are told in them, which is what lets them be weighed against each other.
"""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from odeform.errors import InputError
from odeform.geometry.rigid import best_rigid, body_spin, rotation_from_vector, vector_from_rotation
from odeform.identification.observation import Observation
from odeform.models.base import Predictor
from odeform.motion.evaluated_basis import evaluate_basis
from odeform.motion.reduced_motion import ReducedMotion
from odeform.motion.reduced_space import POSE, to_canonical
from odeform.schema import Parameters, Schema
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Frames, PointCloud, Rotations, Times, Vectors

__all__ = ["ACCURATE", "Comparison", "Linear", "derivatives", "parameters_of"]

ACCURATE = SolverSettings("dopri5", tolerance=1e-6)
"""Solver errors below 0.01 mm. The first frames of a kick, where models err by some hundredths, tell most of all."""
ENOUGH = 4  # points that have a pose of their own
APART = 1e-2  # of central differences, in halves of the trained range


@runtime_checkable
class Differentiable(Protocol):
    """A predictor that gives exact derivatives."""

    def sensitivities(
        self, theta: Floats, times: Times, quality: SolverSettings
    ) -> Float[np.ndarray, "jet times y"]: ...


@dataclass(frozen=True, eq=False)
class Linear:
    """`off` (T, 3 N) mm is observed less predicted, `spread` (T, 3 N, 6 + K) what the causes do to the points, and
    `gain` (T, 6 + K, P) mm, the causes by a change of each parameter by half of its trained range."""

    off: Float[np.ndarray, "times coordinates"]
    spread: Float[np.ndarray, "times coordinates causes"]
    gain: Float[np.ndarray, "times causes parameters"]


def parameters_of(schema: Schema, theta: Floats, heading: float) -> Parameters:
    """Parameters in their units from (P,) in [-1, 1] and the azimuth, if the scene has one."""
    learned = iter(theta)
    return {p.name: heading if p.role == "azimuth" else p.denormalise(float(next(learned))) for p in schema.parameters}


def _solved(
    predictor: Predictor, parameters: Parameters, quality: str | SolverSettings = "balanced", until: float | None = None
) -> ReducedMotion:
    motion = predictor.solve(None, parameters, quality, until)
    if not isinstance(motion, ReducedMotion):
        raise InputError(f"identify: expected a model of reduced motions, got {predictor.model}")
    return motion


def _motion(predictor: Predictor, theta: Floats, times: Times) -> Floats:
    motion = _solved(predictor, parameters_of(predictor.schema, theta, 0.0), ACCURATE, float(times.max()))
    return motion.trajectory.reduced(predictor.schema.window.soft_clamped(times))


def derivatives(predictor: Predictor, theta: Floats, times: Times) -> Float[np.ndarray, "jet times y"]:
    """(1 + P, T, 6 + K): the reduced motion under theta (P,) in [-1, 1], and its derivatives by each parameter.

    Exact where the model has them, else by central differences.
    """
    window = predictor.schema.window
    if isinstance(predictor, Differentiable) and (not window.reach or times.max() <= window.stop):
        return predictor.sensitivities(theta, times, ACCURATE)
    ahead = APART * np.eye(len(theta))
    slopes = [
        (_motion(predictor, theta + h, times) - _motion(predictor, theta - h, times)) / (2 * APART) for h in ahead
    ]
    return np.stack([_motion(predictor, theta, times), *slopes])


class Comparison:
    """An observation held against what a predictor says of it under any parameters."""

    def __init__(self, predictor: Predictor, observation: Observation) -> None:
        self.predictor, self.observation = predictor, observation
        self._space = _solved(predictor, {}).space
        evaluated = evaluate_basis(PointCloud(observation.rest), self._space, observation.heading)
        self._rest, self._modes = evaluated.rest.astype(float), evaluated.values.astype(float)
        self._seen = to_canonical(observation.positions, self._space.anchor, observation.heading)

    def at(self, theta: Floats, sloped: bool = True) -> Linear:
        """Under theta (P,) in [-1, 1]; unless `sloped`, without the gains, which is cheaper."""
        times, modes = self.observation.times, self._modes
        jet = derivatives(self.predictor, theta, times) if sloped else _motion(self.predictor, theta, times)[None]
        y, change = jet[0], jet[1:]
        body = self._rest + (y[:, POSE:] @ modes).reshape(len(y), -1, 3)
        turn, shift = rotation_from_vector(y[:, 3:POSE]), y[:, :3]
        lever = self._space.gyration_radius * np.sqrt(2.0 / 3.0)  # see `small_motion`
        posed = np.zeros((len(y), POSE))
        if len(self._rest) >= ENOUGH:
            # errors of the pose are large enough to look like deformations unless they are seen as turns
            predicted, (turn, shift) = turn, _pose(body, self._seen)
            spin = vector_from_rotation(predicted.swapaxes(1, 2) @ turn)
            posed = 1e3 * np.concatenate([shift - y[:, :3], lever * spin], axis=1)
        # in the body's own axes, where the modes stay as they are
        spread = np.empty((*body.shape, y.shape[1]))
        spread[..., :3] = turn.swapaxes(1, 2)[:, None]
        spread[..., 3:POSE] = np.cross(np.eye(3)[:, None, None], body).transpose(1, 2, 3, 0) / lever
        spread[..., POSE:] = modes.reshape(len(modes), -1, 3).transpose(1, 2, 0)
        spread = spread.reshape(len(y), -1, y.shape[1])
        off = 1e3 * ((self._seen - shift[:, None]) @ turn - body).reshape(len(y), -1)
        off += (spread[..., :POSE] @ posed[..., None])[..., 0]
        spin = lever * body_spin(y[:, 3:POSE], change[..., 3:POSE])
        gain = 1e3 * np.concatenate([change[..., :3], spin, change[..., POSE:]], axis=2)
        return Linear(off, spread, gain.transpose(1, 2, 0))


def _pose(body: Frames, seen: Frames) -> tuple[Rotations, Vectors]:
    """The turn about the anchor and the shift that take `body` (T, N, 3) closest to `seen` (T, N, 3)."""
    even = np.full(body.shape[1], 1.0 / body.shape[1])
    turn, shift = best_rigid(body, seen, even)
    centre = body.mean(axis=1)
    return turn, shift + centre - np.einsum("tij,tj->ti", turn, centre)
