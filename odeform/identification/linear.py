"""A predicted motion, linearised at some parameters and compared with an observation.

The difference at a point has few causes: the body is shifted, rotated, or deformed in its modes. These `causes` are
6 + K numbers a frame, each in millimetres of RMS displacement over the body. Changes of the parameters and errors of
the model are both expressed in them, so that one can be weighed against the other.
"""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from odeform.errors import InputError
from odeform.geometry.rigid import best_rigid, body_spin, rotation_from_vector, vector_from_rotation
from odeform.identification.observation import Observation
from odeform.models.base import Predictor
from odeform.models.frontier import cheapest_within_error
from odeform.motion.evaluated_basis import evaluate_basis
from odeform.motion.reduced_motion import ReducedMotion
from odeform.motion.reduced_space import POSE, to_canonical
from odeform.schema import Parameters, Schema
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Frames, PointCloud, Rotations, Times, Vectors

__all__ = ["ACCURATE", "Comparison", "Linear", "derivatives", "parameters_of"]

ACCURATE, ACCURATE_MM = SolverSettings("dopri5", tolerance=1e-6), 0.01
"""Solver errors stay below 0.01 mm: the first frames of a kick, with model errors of some hundredths, matter most."""
ENOUGH = 4  # points that define a pose
DIFFERENCE = 1e-2  # step of central differences, in halves of the trained range


@runtime_checkable
class Differentiable(Protocol):
    """A predictor with exact derivatives."""

    def sensitivities(
        self, theta: Floats, times: Times, quality: SolverSettings
    ) -> Float[np.ndarray, "jet times y"]: ...


@dataclass(frozen=True, eq=False)
class Linear:
    """A linearised comparison.

    `off` (T, 3 N) mm is observed minus predicted, `spread` (T, 3 N, 6 + K) the effect of each cause on the points, and
    `jacobian` (T, 6 + K, P) mm the causes for a change of each parameter by half of its trained range.
    """

    residual: Float[np.ndarray, "times coordinates"]
    spread: Float[np.ndarray, "times coordinates causes"]
    jacobian: Float[np.ndarray, "times causes parameters"]


def parameters_of(schema: Schema, theta: Floats, azimuth: float) -> Parameters:
    """Parameters in their units from (P,) in [-1, 1] and the azimuth, if the scene has one; a body has its own."""
    found = {p.name: p.denormalise(float(unit)) for p, unit in zip(schema.learned, theta, strict=True)}
    return found | {p.name: azimuth for p in schema.parameters if p.role == "azimuth"}


def _solved(
    predictor: Predictor, parameters: Parameters, quality: str | SolverSettings = "balanced", until: float | None = None
) -> ReducedMotion:
    motion = predictor.solve(None, parameters, quality, until)
    if not isinstance(motion, ReducedMotion):
        raise InputError(f"identify: expected a model of reduced motions, got {predictor.model}")
    return motion


def _motion(predictor: Predictor, theta: Floats, times: Times) -> Floats:
    frontier = predictor.frontier  # differences take many motions: the cheapest that is accurate
    quality = cheapest_within_error(frontier, ACCURATE_MM).quality if frontier else ACCURATE
    motion = _solved(predictor, parameters_of(predictor.schema, theta, 0.0), quality, float(times.max()))
    return motion.trajectory.reduced(predictor.schema.window.soft_clamped(times))


def derivatives(predictor: Predictor, theta: Floats, times: Times) -> Float[np.ndarray, "jet times y"]:
    """Computes (1 + P, T, 6 + K): the reduced motion under theta (P,) in [-1, 1], and its derivatives by each
    parameter.

    Exact where the model has them, else by central differences.
    """
    window = predictor.schema.window
    if isinstance(predictor, Differentiable) and (not window.reach or times.max() <= window.stop):
        return predictor.sensitivities(theta, times, ACCURATE)
    ahead = DIFFERENCE * np.eye(len(theta))
    slopes = [
        (_motion(predictor, theta + h, times) - _motion(predictor, theta - h, times)) / (2 * DIFFERENCE) for h in ahead
    ]
    return np.stack([_motion(predictor, theta, times), *slopes])


class Comparison:
    """An observation compared with the motion of a predictor at any parameters."""

    def __init__(self, predictor: Predictor, observation: Observation) -> None:
        self.predictor, self.observation = predictor, observation
        self._space = _solved(predictor, {}).space
        evaluated = evaluate_basis(PointCloud(observation.rest), self._space, observation.azimuth)
        self._rest, self._modes = evaluated.rest.astype(float), evaluated.values.astype(float)
        self._observed = to_canonical(observation.positions, self._space.anchor, observation.azimuth)

    def at(self, theta: Floats, sloped: bool = True) -> Linear:
        """The comparison at theta (P,) in [-1, 1]; without jacobians unless `sloped`, which is cheaper."""
        times, modes = self.observation.times, self._modes
        jet = derivatives(self.predictor, theta, times) if sloped else _motion(self.predictor, theta, times)[None]
        y, change = jet[0], jet[1:]
        body = self._rest + (y[:, POSE:] @ modes).reshape(len(y), -1, 3)
        turn, shift = rotation_from_vector(y[:, 3:POSE]), y[:, :3]
        lever = self._space.gyration_radius * np.sqrt(2.0 / 3.0)  # see `small_motion`
        posed = np.zeros((len(y), POSE))
        if len(self._rest) >= ENOUGH:
            # pose errors are so large that they look like deformations unless they are treated as rotations
            predicted, (turn, shift) = turn, _pose(body, self._observed)
            spin = vector_from_rotation(predicted.swapaxes(1, 2) @ turn)
            posed = 1e3 * np.concatenate([shift - y[:, :3], lever * spin], axis=1)
        # in the body's own axes, where the modes are constant
        spread = np.empty((*body.shape, y.shape[1]))
        spread[..., :3] = turn.swapaxes(1, 2)[:, None]
        spread[..., 3:POSE] = np.cross(np.eye(3)[:, None, None], body).transpose(1, 2, 3, 0) / lever
        spread[..., POSE:] = modes.reshape(len(modes), -1, 3).transpose(1, 2, 0)
        spread = spread.reshape(len(y), -1, y.shape[1])
        residual = 1e3 * ((self._observed - shift[:, None]) @ turn - body).reshape(len(y), -1)
        residual += (spread[..., :POSE] @ posed[..., None])[..., 0]
        spin = lever * body_spin(y[:, 3:POSE], change[..., 3:POSE])
        jacobian = 1e3 * np.concatenate([change[..., :3], spin, change[..., POSE:]], axis=2)
        return Linear(residual, spread, jacobian.transpose(1, 2, 0))


def _pose(body: Frames, observed: Frames) -> tuple[Rotations, Vectors]:
    """The rotation about the anchor and the shift that bring `body` (T, N, 3) m closest to `observed` (T, N, 3) m."""
    even = np.full(body.shape[1], 1.0 / body.shape[1])
    turn, shift = best_rigid(body, observed, even)
    centre = body.mean(axis=1)
    return turn, shift + centre - np.einsum("tij,tj->ti", turn, centre)
