"""ODeform for a round body that is pushed, flies and rolls: the ODE is its motion, under a learned law of contact."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.checkpoint import Checkpoint
from odeform.mechanics.rolling.dynamics import MOVING, STATE
from odeform.mechanics.rolling.field import make_field, units_of
from odeform.mechanics.rolling.law import RollingLaw
from odeform.mechanics.rolling.support import support_of
from odeform.models.frontier import FrontierPoint
from odeform.models.odeform.correction import Correction
from odeform.models.odeform.latent_trajectory import LatentTrajectory
from odeform.models.reduced_model import ReducedModel
from odeform.models.rolling.readout import Readout, inputs_of
from odeform.models.rolling.start import Start
from odeform.motion.changed_trajectory import ChangedTrajectory
from odeform.motion.corrected_trajectory import CorrectedTrajectory
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.lifted_trajectory import LiftedTrajectory
from odeform.motion.reduced_motion import Trajectory
from odeform.motion.reduced_space import POSE
from odeform.motion.rolling import Rolling
from odeform.solver.integrate import SolverSettings
from odeform.solver.method import Field
from odeform.types import Floats, Times, Vector

__all__ = ["RollingODeform", "placed"]

FALLBACK = SolverSettings("rk4", step=1e-3, dtype="float64")
UP = np.array([0.0, 0.0, 1.0])


def placed(states: Float[np.ndarray, "rows states"], axis: Vector) -> Float[np.ndarray, "rows 6"]:
    """(R, 8) states of a body that turns about the level unit vector `axis` -> (R, 6): shift (m), rotation vector."""
    ahead = np.cross(axis, UP)
    return np.concatenate([states[:, :1] * ahead + states[:, 1:2] * UP, states[:, 2:3] * axis], axis=1)


class RollingODeform(ReducedModel):
    """The motion of one round body in a plane."""

    model = "odeform-rolling"
    continues_itself = True

    def _read(self, checkpoint: Checkpoint) -> None:
        super()._read(checkpoint)
        arrays, config = checkpoint.arrays, checkpoint.config
        self.qualities = {name: SolverSettings(**values) for name, values in config["qualities"].items()}
        self.frontier = tuple(FrontierPoint.from_json(row) for row in config.get("frontier", ()))
        learned = [parameter.name for parameter in self.schema.learned]
        self._materials = [learned.index(name) for name in config["material"]]
        self.begin = float(config["begin_s"])
        """Seconds at which the push is over and the ODE begins."""
        self._radius = float(config["radius_m"])
        self._units = units_of(self._radius)
        self._lowest = float(config["lowest_m"])
        self.law = RollingLaw.from_arrays(arrays, len(self._materials))
        self._start = Start.from_arrays(arrays, len(learned))
        self._readout = Readout.from_arrays(arrays, len(self._materials), self.rolling.patterns)
        self.correction = Correction.from_arrays(arrays, self.space.coordinates, len(learned))
        # the body that viewers show is smoother than the one whose corners it rolls over
        self._support = support_of(self.space.basis.scale * self.space.basis.centers, self.rolling.axis)

    @property
    def rolling(self) -> Rolling:
        """Its axis, and its patterns of deformation. ValueError in a checkpoint without."""
        if self.space.rolling is None:
            raise ValueError("rolling.axis: expected the axis of a rolling body")
        return self.space.rolling

    def problem(self, theta: Floats) -> tuple[Field, Floats]:
        """The initial value problem for theta (P,) in [-1, 1]: the field, and the state (8,) when the push is over.

        Angle and spin of its states are the way and the speed of the rim (`units_of`).
        """
        field = make_field(self.law, self._support, self._radius, theta[self._materials])
        start = np.zeros(STATE)
        start[: 2 * MOVING] = self._start.at(theta[None])[0]
        return field, start * self._units

    def decode(self, states: Float[np.ndarray, "rows states"], theta: Floats) -> Float[np.ndarray, "rows y"]:
        """States (R, 8) of `problem` -> (R, 6 + S)."""
        states = states / self._units
        material = np.tile(theta[self._materials], (len(states), 1))
        touch = 1e-3 * self.law.coefficients(material[:1])["touch"]
        deformation = self._readout(inputs_of(states.T, np.repeat(touch, len(states)), material))
        return np.concatenate([placed(states, self.rolling.axis), deformation], axis=1)

    def integrate(self, theta: Floats, quality: SolverSettings, until: float) -> Trajectory:
        """The motion for theta (P,) in [-1, 1], without its correction, solved to `until` seconds."""
        field, start = self.problem(theta)

        def decode(_: Floats, states: Floats) -> Floats:
            return self.decode(states, theta)

        start = start.astype(quality.dtype)
        solved = LatentTrajectory(
            field,
            decode,
            start,
            quality,
            FALLBACK,
            max(until - self.begin, 1.0 / self.schema.window.rate),
            self.space.gyration_radius,
            lambda: (field, start.astype(float)),
        )
        first = self.decode(start[None].astype(float), theta)[0]
        rates = (start.astype(float) / self._units)[None, MOVING:]
        return _Begun(solved, self.begin, first, placed(rates, self.rolling.axis)[0])

    def trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> Trajectory:
        assert settings is not None
        solved = self.integrate(theta, settings, until)
        if (known := self.correction) is not None:
            solved = CorrectedTrajectory(solved, known.shares, known.over_time(theta), known.stop)
        return LiftedTrajectory(solved, self._lowest_points, self._lowest)

    def _lowest_points(self, y: Float[np.ndarray, "times y"]) -> Times:
        """(T, 6 + S) -> (T,) heights in m of the body's lowest point."""
        return self.watched_body.sample(self.space.with_modes(y), np.ones(len(y))).lowest


@dataclass(frozen=True, eq=False)
class _Push:
    """The motion during the push: from rest to where the ODE begins, with its velocity there."""

    begin: float
    y: Float[np.ndarray, " y"]
    rate: Float[np.ndarray, "6"]

    def at(self, times: Times) -> Float[np.ndarray, "times y"]:
        """(T,) s from 0 to `begin` -> (T, 6 + S): cubic in time."""
        share = (times / self.begin)[:, None]
        out = share**2 * (3.0 - 2.0 * share) * self.y
        out[:, :POSE] += share**2 * (share - 1.0) * self.begin * self.rate
        return out


class _Begun(ChangedTrajectory):
    """A motion that is solved from the end of the push on."""

    def __init__(self, own: Trajectory, begin: float, y: Floats, rate: Floats) -> None:
        """`y` (6 + S,) and the pose's `rate` (6,) per second are those at `begin` seconds."""
        super().__init__(own)
        self._push = _Push(begin, y, rate)

    @property
    def last_good(self) -> float:
        """Seconds up to which it is valid."""
        return self._push.begin + self.own.last_good

    def reduced(self, times: Times) -> Float[np.ndarray, "times y"]:
        """(T,) s -> (T, 6 + S), zero at time 0."""
        times = np.asarray(times, dtype=float)
        push, later = self._push, times > self._push.begin
        out = push.at(np.minimum(times, push.begin))
        if later.any():
            out[later] = push.y + self.own.reduced(times[later] - push.begin)
        return out
