"""The rolling model, of a round body that falls, or is pushed, flies and rolls: the ODE is its motion, under learned
contact parameters."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from jaxtyping import Float

from odeform.checkpoint import Checkpoint
from odeform.mechanics.rolling.contact import RollingContact
from odeform.mechanics.rolling.dynamics import MOVING, STATE
from odeform.mechanics.rolling.field import make_field, units_of
from odeform.mechanics.rolling.support import support_of
from odeform.models.model import Model
from odeform.models.residual import parameter_residual
from odeform.models.rolling.phases import RISING, Push, rising
from odeform.models.rolling.readout import Readout, inputs_of
from odeform.models.rolling.start import Start, push_inputs, read_start
from odeform.models.solved import Problem, SolvedTrajectory
from odeform.models.solved_batch import BatchProblem, SolvedBatch
from odeform.motion.batch_trajectory import AdjustedBatch, BatchTrajectory, PiecewiseBatch
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.floor_projection import raised
from odeform.motion.reduced_space import POSE, ReducedSpace
from odeform.motion.trajectory import Adjusted, Moving, Piecewise, Trajectory
from odeform.schema import BEYOND, Parameters, soft_clip
from odeform.solver.batch_steps import BatchField, Together
from odeform.solver.integrate import SolverSettings
from odeform.solver.method import Field
from odeform.types import Floats, Geometry, Times, Vector

if TYPE_CHECKING:
    from odeform.models.training.run import Run

__all__ = ["UNTURNED", "RollingModel", "axes_of"]

FINER = {SolverSettings("dopri5", tolerance=1e-9, dtype="float64"): 0.0}
"""Settings that errors of the solver are measured against, and the mm from which on that suffices: a landing that comes
a moment later on a corner amplifies what coarser solutions leave."""
UP = np.array([0.0, 0.0, 1.0])
UNTURNED = np.array([0.0, 1.0, 0.0])
"""The axis of a body that does not turn: any level one."""


def axes_of(axis: Vector) -> Float[np.ndarray, "3 6"]:
    """Returns what a unit of way ahead (m), of height (m) and of angle (rad), about the level unit vector `axis`,
    adds to shift (m) and rotation vector. The same of their rates."""
    out = np.zeros((MOVING, POSE))
    out[0, :3], out[1, :3], out[2, 3:] = np.cross(axis, UP), UP, axis
    return out


def trained(theta: Floats) -> Floats:
    """Inputs (..., P) of what was only learned, which nothing bounds far from the trained ranges."""
    return soft_clip(theta, 1.0, BEYOND)


class RollingModel(Model):
    """The motion of one round body in a plane, or up and down.

    Mechanics goes on past the trained ranges: start, contact and ODE follow the parameters themselves. The deformation
    and the residual, which are learned, follow inputs that are clipped (`trained`).
    """

    model = "rolling"
    reach = (2.0, 1.0)
    made_of = (
        "mechanics: a round body that flies, lands and rolls, with fitted contact coefficients that a small network "
        "adjusts; a second network reads the deformation off the state; the push is regressed on the parameters"
    )
    together = 256
    continues_itself = True
    fallback = SolverSettings("rk4", step=1e-3, dtype="float64")
    finer = MappingProxyType(FINER)
    ablations: ClassVar[Mapping[str, str]] = {
        "network": "coefficients of the contact depend on the material alone",
        "corners": "the body rolls over a smooth floor on a smooth rim",
        "residual": "what is left unexplained is not regressed",
    }
    resumable = True

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
        self._axes, self._radius = axes_of(self._axis), float(config["radius_m"])
        self._units = units_of(self._radius)
        self._lowest = float(config["lowest_m"])
        self.contact = RollingContact.from_arrays(arrays, len(self._materials))
        regression = read_start(arrays, push_inputs(self.schema, np.zeros((1, len(learned)))).shape[1])
        self._start = Start(regression, self.schema, self.contact)
        self._readout = Readout.from_arrays(arrays, len(self._materials), self.space.coordinates - POSE)
        self.residual = parameter_residual(arrays, self.space.coordinates, len(learned))
        # the body that viewers show is smoother than the one whose corners it rolls over
        self._support = support_of(self.space.basis.scale * self.space.basis.centers, self._axis)

    @cached_property
    def space(self) -> ReducedSpace:
        own = super().space
        return replace(own, largest=(np.inf, own.largest[1]))  # how far the body gets follows from the mechanics

    def residual_inputs(self, theta: Floats) -> Floats:
        return trained(theta)

    def problem(self, theta: Floats, evaluated: EvaluatedBasis, dtype: type = np.float64) -> Problem:
        """The state (8,) begins when the push is over; the push itself is a cubic to there.

        Angle and spin of states are the way and the speed of the rim (`units_of`). States are in double precision
        whatever is asked for: at landings on corners, rounding in single precision grows to tenths of a millimetre.
        """
        start, readout = self._begun(theta)
        return Problem(self._field(theta), start, readout, self.begin)

    def batch_problem(
        self, theta: Floats, geometry: Geometry, azimuths: Times, dtype: type
    ) -> Callable[[], BatchProblem]:
        start, readout = self._begun(theta)
        return lambda: BatchProblem(self._together(theta), start, readout, self.begin)

    def _field(self, theta: Floats) -> Field:
        return make_field(self.contact, self._support, self._radius, theta[self._materials])

    def _together(self, theta: Float[np.ndarray, "batch parameters"]) -> BatchField:
        return Together([self._field(each) for each in theta])

    def _begun(self, theta: Float[np.ndarray, "*batch parameters"]) -> tuple[Floats, Callable[[Times, Floats], Floats]]:
        """States (..., 8) when the push is over, and the readout from then on, for theta (..., P)."""
        # one by one, to the last bit: a landing that comes a moment later on a corner amplifies what differs
        moving = [self._start(each) for each in np.atleast_2d(theta)]
        start = np.zeros((*theta.shape[:-1], STATE))
        start[..., : 2 * MOVING] = np.reshape(moving, (*theta.shape[:-1], 2 * MOVING))
        pose, rate = self._placed(start[..., :MOVING]), start[..., MOVING : 2 * MOVING] @ self._axes
        push, decoded = Push(self.begin, pose, rate, self.space.coordinates), self._decoder(theta)

        def readout(times: Times, states: Floats) -> Floats:
            y = decoded(states / self._units)
            if times.min(initial=np.inf) < self.begin + RISING:
                # how the push deforms the body does not follow from the motion: it is regressed
                y[..., POSE:] *= rising(times - self.begin)[:, None]
                early = times < self.begin
                y[..., early, :] = push(times[early])
            return y

        return start * self._units, readout

    def _placed(self, moved: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 6"]:
        """(..., 3) ahead, up (m) and angle (rad) of states -> (..., 6) shift (m), rotation vector."""
        return (moved - [0.0, self._clearance, 0.0]) @ self._axes

    def _decoder(self, theta: Float[np.ndarray, "*batch parameters"]) -> Callable[[Floats], Floats]:
        """States (..., T, 8) under theta (..., P) -> coordinates (..., T, 6 + S)."""
        bodies = np.atleast_2d(theta)[:, self._materials]
        heights, material = 1e-3 * self.contact.coefficients(bodies)["height"], trained(bodies)

        def decoded(states: Float[np.ndarray, "*batch times states"]) -> Float[np.ndarray, "*batch times y"]:
            rows, times = states.reshape(-1, STATE), states.shape[-2]
            repeated = 1 if len(bodies) == 1 else times  # of one body, they are broadcast
            of_rows = (np.repeat(part, repeated, axis=0) for part in (heights, material))
            inputs = inputs_of(rows.T, *of_rows)
            y = np.concatenate([self._placed(rows[:, :MOVING]), self._readout(inputs)], axis=1)
            return y.reshape(*states.shape[:-1], -1)

        return decoded

    @property
    def _restart(self) -> float | None:
        """Seconds from which on motions are solved anew; None where they are not."""
        stop = np.inf if self.residual is None else self.residual.stop
        return stop if self.schema.window.stop <= stop < np.inf else None

    def trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> Trajectory:
        assert settings is not None
        stop = self._restart
        motion = super().trajectory(theta, evaluated, settings, until if stop is None else min(until, stop))
        if stop is not None:
            assert isinstance(motion, Adjusted)
            corrected = motion
            motion = Piecewise(motion, stop, lambda: self._restarted(theta, corrected, settings, stop, until))
        return motion

    def batch_trajectory(
        self, geometry: Geometry, sets: Sequence[Parameters], settings: SolverSettings, until: float
    ) -> BatchTrajectory:
        stop = self._restart
        motion = super().batch_trajectory(geometry, sets, settings, until if stop is None else min(until, stop))
        if stop is not None:
            assert isinstance(motion, AdjustedBatch)
            theta, corrected = self.batch_inputs(sets), motion
            motion = PiecewiseBatch(
                motion, stop, lambda: self._restarted_batch(theta, corrected, settings, stop, until)
            )
        return motion

    def to_body(self, times: Times, y: Floats) -> Float[np.ndarray, "*batch times body_y"]:
        return raised(super().to_body(times, y), self.checked_body.lowest, self._lowest)

    def _restarted(
        self, theta: Floats, corrected: Adjusted, settings: SolverSettings, stop: float, until: float
    ) -> Trajectory:
        """Solves from `stop` seconds on, from where the corrected motion is, and as it moves there."""
        solved = corrected.inner
        assert isinstance(solved, SolvedTrajectory)
        start, readout = self._resumed(theta, solved, corrected, stop)
        problem = Problem(self._field(theta), start, readout, stop)
        return self._solved(problem, lambda: problem, settings, until)

    def _restarted_batch(
        self, theta: Floats, corrected: AdjustedBatch, settings: SolverSettings, stop: float, until: float
    ) -> BatchTrajectory:
        solved = corrected.inner
        assert isinstance(solved, SolvedBatch)
        start, readout = self._resumed(theta, solved, corrected, stop)
        problem = BatchProblem(self._together(theta), start, readout, stop)
        return SolvedBatch(lambda: problem, settings, until, 1.0 / self.schema.window.rate)

    def _resumed(
        self, theta: Floats, solved: SolvedTrajectory | SolvedBatch, corrected: Moving, stop: float
    ) -> tuple[Floats, Callable[[Times, Floats], Floats]]:
        """States (..., 8) of the corrected motions at `stop` seconds, and the readout from then on."""
        decoded, times = self._decoder(theta), np.array([stop])
        start = solved.states(times)[..., 0, :] + self._units * self._added(solved, corrected, stop)
        # alone and among others, it differs in the last bits, which later landings would amplify
        start = start.astype(np.float32).astype(float)
        end, first = corrected.reduced(times), decoded(start[..., None, :] / self._units)
        # what the residual adds to the deformation gives way to what follows from the motion
        given_up = end - first
        given_up[..., :POSE] = 0.0

        def readout(times: Times, states: Floats) -> Floats:
            moved = decoded(states / self._units) - first
            return end + moved - rising(times - stop)[:, None] * given_up

        return start, readout

    def _added(self, solved: Moving, corrected: Moving, time: float) -> Float[np.ndarray, "*batch 8"]:
        """Returns what the residual adds to the state at `time` seconds. Its rate is that of the last frame: a contact
        may be so short that corrected frames do not tell the velocity."""
        rate = self.schema.window.rate
        times = np.array([time - 1.0 / rate, time])
        added = corrected.reduced(times)[..., :POSE] - solved.reduced(times)[..., :POSE]
        moved = np.stack(
            [added[..., :3] @ np.cross(self._axis, UP), added[..., 2], added[..., 3:] @ self._axis], axis=-1
        )
        if self.space.rolling is None:
            moved[..., [0, 2]] = 0.0
        before, now = moved[..., 0, :], moved[..., 1, :]
        rest = np.zeros((*now.shape[:-1], STATE - 2 * MOVING))
        return np.concatenate([now, (now - before) * rate, rest], axis=-1)
