"""ODeform for a round body that falls, or is pushed, flies and rolls: the ODE is its motion, under a learned law of
contact."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from jaxtyping import Float

from odeform.checkpoint import Checkpoint
from odeform.mechanics.rolling.dynamics import MOVING, STATE, RollingDynamics
from odeform.mechanics.rolling.field import make_field, units_of
from odeform.mechanics.rolling.law import RollingLaw
from odeform.mechanics.rolling.support import support_of
from odeform.models.integrated_model import IntegratedModel
from odeform.models.latent.correction import Correction
from odeform.models.latent.inference import Decoder
from odeform.models.latent.latent_trajectory import LatentTrajectory
from odeform.models.reduced_batches import CorrectedBatch, LiftedBatch
from odeform.models.rolling.batch import BegunBatch, ResumedBatch, batch_field
from odeform.models.rolling.phases import Begun, Resumed
from odeform.models.rolling.readout import Readout, inputs_of
from odeform.models.rolling.start import Start, push_inputs
from odeform.models.solved_batch import BatchProblem, SolvedBatch
from odeform.motion.corrected_trajectory import CorrectedTrajectory
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.lifted_trajectory import LiftedTrajectory, floor_lift
from odeform.motion.reduced_batch import BatchTrajectory
from odeform.motion.reduced_motion import Trajectory
from odeform.motion.reduced_space import POSE
from odeform.schema import Parameters
from odeform.solver.integrate import SolverSettings
from odeform.solver.method import Field
from odeform.types import Floats, Geometry, Times, Vector

if TYPE_CHECKING:
    from odeform.models.training.run import Run

__all__ = ["UNTURNED", "RollingModel", "placed"]

FINER = {SolverSettings("dopri5", tolerance=1e-9, dtype="float64"): 0.0}
"""What errors of the solver are measured against, and the mm from which on that suffices: a landing that comes a moment
later on a corner amplifies what coarser solutions leave."""
FALLBACK = SolverSettings("rk4", step=1e-3, dtype="float64")
UP = np.array([0.0, 0.0, 1.0])
UNTURNED = np.array([0.0, 1.0, 0.0])
"""The axis of a body that does not turn: any level one."""


def placed(moved: Float[np.ndarray, "rows 3"], axis: Vector) -> Float[np.ndarray, "rows 6"]:
    """(R, 3) ahead, up (m) and angle (rad), about the level unit vector `axis` -> (R, 6): shift (m), rotation vector.
    The same of their rates."""
    ahead = np.cross(axis, UP)
    return np.concatenate([moved[:, :1] * ahead + moved[:, 1:2] * UP, moved[:, 2:] * axis], axis=1)


class RollingModel(IntegratedModel):
    """The motion of one round body in a plane, or up and down."""

    model = "rolling"
    together = 256
    continues_itself = True
    ablations: ClassVar[Mapping[str, str]] = {
        "network": "coefficients of the contact law depend on the material alone",
        "corners": "the body rolls over a smooth floor on a smooth rim",
        "correction": "what is left unexplained is not regressed",
    }

    @classmethod
    def train(cls, run: "Run") -> Checkpoint:
        from odeform.models.rolling.training.fit import train_rolling

        return train_rolling(run)

    def _read(self, checkpoint: Checkpoint) -> None:
        super()._read(checkpoint)
        arrays, config = checkpoint.arrays, checkpoint.config
        learned = [parameter.name for parameter in self.schema.learned]
        self._materials = [learned.index(name) for name in config["material"]]
        self.begin = float(config["begin_s"])
        """Seconds at which the ODE begins: the push is over, or the body falls for half a frame."""
        self._clearance = float(config.get("clearance_m", 0.0))
        """m of the lowest point at rest above the floor, which states count their heights from."""
        self._axis = UNTURNED if self.space.rolling is None else self.space.rolling.axis
        self._radius = float(config["radius_m"])
        self._units = units_of(self._radius)
        self._lowest = float(config["lowest_m"])
        self.law = RollingLaw.from_arrays(arrays, len(self._materials))
        self._start = Start.from_arrays(arrays, push_inputs(self.schema, np.zeros((1, len(learned)))).shape[1])
        self._readout = Readout.from_arrays(arrays, len(self._materials), self.space.coordinates - POSE)
        self.correction = Correction.from_arrays(arrays, self.space.coordinates, len(learned))
        # the body that viewers show is smoother than the one whose corners it rolls over
        self._support = support_of(self.space.basis.scale * self.space.basis.centers, self._axis)

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
        """States (R, 8) of a body of this material (Q,), or of a material each (R, Q) -> (R, 6 + S)."""
        each = np.broadcast_to(material, (len(states), material.shape[-1]))
        touch = 1e-3 * self.law.coefficients(each if material.ndim > 1 else each[:1])["touch"]
        deformation = self._readout(inputs_of(states.T, np.broadcast_to(touch, len(states)), each))
        moved = states[:, :MOVING] - [0.0, self._clearance, 0.0]
        return np.concatenate([placed(moved, self._axis), deformation], axis=1)

    def integrate(self, theta: Floats, evaluated: EvaluatedBasis, quality: SolverSettings, until: float) -> Begun:
        """The motion for theta (P,) in [-1, 1], without its correction, solved to `until` seconds."""
        field, start, decode = self.problem(theta, evaluated, _precision(quality))
        solved = self._solved(field, start, decode, quality, until - self.begin)
        exact = start.astype(float)
        first = decode(np.zeros(1), exact[None])[0]
        rate = placed((exact / self._units)[None, MOVING : 2 * MOVING], self._axis)[0]
        return Begun(solved, self.begin, first, rate)

    def _solved(
        self, field: Field, start: Floats, decode: Decoder, quality: SolverSettings, seconds: float
    ) -> LatentTrajectory:
        exact, least = start.astype(float), 1.0 / self.schema.window.rate
        arm, seconds = self.space.gyration_radius, max(seconds, least)
        return LatentTrajectory(field, decode, start, quality, FALLBACK, seconds, arm, lambda: (field, exact), FINER)

    def trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> Trajectory:
        assert settings is not None
        known, window = self.correction, self.schema.window
        if known is None:
            return self._lifted(self.integrate(theta, evaluated, settings, until))
        resumed = known.stop >= window.stop
        begun = self.integrate(theta, evaluated, settings, min(until, known.stop) if resumed else until)
        corrected = CorrectedTrajectory(begun, known.shares, known.over_time(theta), known.stop)
        if not resumed:
            return self._lifted(corrected)

        def resume() -> tuple[Trajectory, Floats]:
            field, _, decode = self.problem(theta, evaluated, _precision(settings))
            start = begun.state(known.stop) + self._units * self._added(begun, corrected, known.stop)
            start = start.astype(_precision(settings))
            solved = self._solved(field, start, decode, settings, until - known.stop)
            return solved, decode(np.zeros(1), start[None])[0, POSE:]

        return self._lifted(Resumed(corrected, known.stop, resume))

    def batch_trajectory(
        self, geometry: Geometry, sets: Sequence[Parameters], settings: SolverSettings, until: float
    ) -> BatchTrajectory:
        theta, dtype, least = self.schema.batch_inputs(sets), _precision(settings), 1.0 / self.schema.window.rate
        material, known = theta[:, self._materials], self.correction
        start = np.zeros((len(theta), STATE))
        # one by one, to the last bit: a landing that comes a moment later on a corner amplifies what differs
        start[:, : 2 * MOVING] = [self._start.at(push_inputs(self.schema, each[None]))[0] for each in theta]
        exact = (start * self._units).astype(dtype)

        def readout(times: Times, states: Floats) -> Floats:
            each = np.repeat(material, len(times), axis=0)
            rows = states.reshape(len(each), STATE) / self._units
            return self._decoded(rows, each).reshape(*states.shape[:2], -1)

        def solved(begin: Floats, seconds: float) -> SolvedBatch:
            field = batch_field(
                lambda some: RollingDynamics(self.law, self._support, self._radius, some), material, self._units
            )
            return SolvedBatch(lambda: BatchProblem(field, begin, readout), settings, max(seconds, least))

        resumed = known is not None and known.stop >= self.schema.window.stop
        end = min(until, known.stop) if known is not None and resumed else until
        rates = placed((exact.astype(float) / self._units)[:, MOVING : 2 * MOVING], self._axis)
        begun = BegunBatch(
            solved(exact, end - self.begin), self.begin, readout(np.zeros(1), exact[:, None].astype(float))[:, 0], rates
        )
        motion: BatchTrajectory = begun
        if known is not None:
            corrected = CorrectedBatch(begun, known.shares, lambda times: known.at(theta, times), known.stop)
            motion = corrected
            if resumed:

                def resume() -> tuple[SolvedBatch, Floats]:
                    times = np.array([known.stop - least, known.stop])
                    added = corrected.reduced(times)[..., :POSE] - begun.reduced(times)[..., :POSE]
                    more = np.stack([self._added_state(each) for each in added])
                    again = (begun.states(known.stop) + self._units * more).astype(dtype)
                    return solved(again, until - known.stop), readout(np.zeros(1), again[:, None])[:, 0, POSE:]

                motion = ResumedBatch(corrected, known.stop, resume)
        return LiftedBatch(motion, lambda y: floor_lift(self._lowest_points(y), self._lowest))

    def _added(self, own: Trajectory, corrected: Trajectory, time: float) -> Float[np.ndarray, "8"]:
        """What the correction adds to the state at `time` seconds. Its rate is that of the last frame: a contact may be
        so short that corrected frames do not tell the velocity."""
        frame = 1.0 / self.schema.window.rate
        times = np.array([time - frame, time])
        return self._added_state(corrected.reduced(times)[:, :POSE] - own.reduced(times)[:, :POSE])

    def _added_state(self, added: Float[np.ndarray, "2 6"]) -> Float[np.ndarray, "8"]:
        """The same of what is added to the pose at the last two frames."""
        moved = np.stack([added[:, :3] @ np.cross(self._axis, UP), added[:, 2], added[:, 3:] @ self._axis], axis=1)
        if self.space.rolling is None:
            moved[:, [0, 2]] = 0.0
        return np.concatenate([moved[1], (moved[1] - moved[0]) * self.schema.window.rate, np.zeros(STATE - 2 * MOVING)])

    def _lifted(self, motion: Trajectory) -> LiftedTrajectory:
        return LiftedTrajectory(motion, self._lowest_points, self._lowest)

    def _lowest_points(self, y: Float[np.ndarray, "times y"]) -> Times:
        """(T, 6 + S) -> (T,) heights in m of the body's lowest point."""
        return self.watched_body.sample(self.space.with_modes(y), np.ones(len(y))).lowest


def _precision(quality: SolverSettings) -> type:
    return np.float32 if quality.dtype == "float32" else np.float64
