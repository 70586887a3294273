"""ODeform for a round body that is pushed, flies and rolls: the ODE is its motion, under a learned law of contact."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.checkpoint import Checkpoint
from odeform.mechanics.rolling.dynamics import MOVING, STATE
from odeform.mechanics.rolling.field import make_field, units_of
from odeform.mechanics.rolling.law import RollingLaw
from odeform.mechanics.rolling.support import support_of
from odeform.models.integrated_model import IntegratedModel
from odeform.models.odeform.correction import Correction
from odeform.models.odeform.inference import Decoder
from odeform.models.odeform.latent_trajectory import LatentTrajectory
from odeform.models.rolling.readout import Readout, inputs_of
from odeform.models.rolling.start import Start, push_inputs
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

FINER = {SolverSettings("dopri5", tolerance=1e-9, dtype="float64"): 0.0}
"""What errors of the solver are measured against, and the mm from which on that suffices: a landing that comes a moment
later on a corner amplifies what coarser solutions leave."""
FALLBACK = SolverSettings("rk4", step=1e-3, dtype="float64")
RISING = 0.04  # s
UP = np.array([0.0, 0.0, 1.0])


def placed(states: Float[np.ndarray, "rows states"], axis: Vector) -> Float[np.ndarray, "rows 6"]:
    """(R, 8) states of a body that turns about the level unit vector `axis` -> (R, 6): shift (m), rotation vector."""
    ahead = np.cross(axis, UP)
    return np.concatenate([states[:, :1] * ahead + states[:, 1:2] * UP, states[:, 2:3] * axis], axis=1)


class RollingODeform(IntegratedModel):
    """The motion of one round body in a plane."""

    model = "odeform-rolling"
    continues_itself = True

    def _read(self, checkpoint: Checkpoint) -> None:
        super()._read(checkpoint)
        arrays, config = checkpoint.arrays, checkpoint.config
        learned = [parameter.name for parameter in self.schema.learned]
        self._materials = [learned.index(name) for name in config["material"]]
        self.begin = float(config["begin_s"])
        """Seconds at which the push is over and the ODE begins."""
        self._radius = float(config["radius_m"])
        self._units = units_of(self._radius)
        self._lowest = float(config["lowest_m"])
        self.law = RollingLaw.from_arrays(arrays, len(self._materials))
        self._start = Start.from_arrays(arrays, push_inputs(self.schema, np.zeros((1, len(learned)))).shape[1])
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

    def problem(self, theta: Floats, evaluated: EvaluatedBasis, dtype: type) -> tuple[Field, Floats, Decoder]:
        """The initial value problem for theta (P,) in [-1, 1] from when the push is over: the field, the state (8,)
        there, and the decoder of states (R, 8) to coordinates (R, 6 + S).

        Angle and spin of its states are the way and the speed of the rim (`units_of`).
        """
        material = theta[self._materials]
        field = make_field(self.law, self._support, self._radius, material)
        start = np.zeros(STATE)
        start[: 2 * MOVING] = self._start.at(push_inputs(self.schema, theta[None]))[0]

        def decode(_: Times, states: Floats) -> Floats:
            return self._decoded(states / self._units, material)

        return field, (start * self._units).astype(dtype), decode

    def _decoded(self, states: Float[np.ndarray, "rows states"], material: Floats) -> Float[np.ndarray, "rows y"]:
        """States (R, 8) of a body of this material (Q,) -> (R, 6 + S)."""
        each = np.tile(material, (len(states), 1))
        touch = 1e-3 * self.law.coefficients(each[:1])["touch"]
        deformation = self._readout(inputs_of(states.T, np.repeat(touch, len(states)), each))
        return np.concatenate([placed(states, self.rolling.axis), deformation], axis=1)

    def integrate(self, theta: Floats, evaluated: EvaluatedBasis, quality: SolverSettings, until: float) -> Trajectory:
        """The motion for theta (P,) in [-1, 1], without its correction, solved to `until` seconds."""
        field, start, decode = self.problem(theta, evaluated, np.float32 if quality.dtype == "float32" else np.float64)
        exact = start.astype(float)
        solved = LatentTrajectory(
            field,
            decode,
            start,
            quality,
            FALLBACK,
            max(until - self.begin, 1.0 / self.schema.window.rate),
            self.space.gyration_radius,
            lambda: (field, exact),
            FINER,
        )
        first = decode(np.zeros(1), exact[None])[0]
        rate = placed((exact / self._units)[None, MOVING:], self.rolling.axis)[0]
        return _Begun(solved, self.begin, first, rate)

    def trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> Trajectory:
        assert settings is not None
        solved: Trajectory = self.integrate(theta, evaluated, settings, until)
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
    pose: Float[np.ndarray, "6"]
    rate: Float[np.ndarray, "6"]

    def at(self, times: Times) -> Float[np.ndarray, "times 6"]:
        """(T,) s from 0 to `begin` -> (T, 6): cubic in time."""
        share = (times / self.begin)[:, None]
        ramp = share**2 * (3.0 - 2.0 * share) * self.pose
        return ramp + share**2 * (share - 1.0) * self.begin * self.rate


class _Begun(ChangedTrajectory):
    """A motion that is solved from the end of the push on.

    How the push deforms the body does not follow from the motion: it is regressed (`Correction`). What contacts do
    takes its place in `RISING` seconds.
    """

    def __init__(self, own: Trajectory, begin: float, y: Floats, rate: Floats) -> None:
        """`y` (6 + S,) and the pose's `rate` (6,) per second are those at `begin` seconds."""
        super().__init__(own)
        self._push, self._first = _Push(begin, y[:POSE], rate), y

    @property
    def last_good(self) -> float:
        """Seconds up to which it is valid."""
        return self._push.begin + self.own.last_good

    def reduced(self, times: Times) -> Float[np.ndarray, "times y"]:
        """(T,) s -> (T, 6 + S), zero at time 0."""
        times = np.asarray(times, dtype=float)
        push, later = self._push, times > self._push.begin
        out = np.zeros((len(times), len(self._first)))
        out[~later, :POSE] = push.at(times[~later])
        if later.any():
            after = times[later] - push.begin
            out[later] = self._first + self.own.reduced(after)
            risen = np.minimum(after / RISING, 1.0)
            out[later, POSE:] *= (risen**2 * (3.0 - 2.0 * risen))[:, None]
        return out
