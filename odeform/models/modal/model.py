"""ODeform for bodies of known shape and material: the ODE is reduced mechanics, with few learned numbers."""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from jaxtyping import Float

from odeform.checkpoint import Checkpoint
from odeform.geometry.contact import checked_contact
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.mechanics.flat import body_motion
from odeform.mechanics.push import Push, make_push
from odeform.mechanics.pushed import PushedBody
from odeform.mechanics.pushed_batch import pushed_bodies
from odeform.mechanics.step import Mechanics, Projectile
from odeform.models.contact.inputs import ContactInputs
from odeform.models.modal.contact_residual import contact_residual
from odeform.models.modal.coordinates import Coordinates, coordinates_of, space_of
from odeform.models.modal.elastic_body import ElasticBody
from odeform.models.model import Model
from odeform.models.solved import Problem
from odeform.models.solved_batch import BatchProblem
from odeform.motion.batch_trajectory import AdjustedBatch, BatchTrajectory
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.floor_projection import FloorProjection
from odeform.motion.recent import Recent
from odeform.motion.reduced_space import ReducedSpace
from odeform.motion.trajectory import Adjusted, Moving, Trajectory
from odeform.schema import Parameters
from odeform.solver.integrate import SolverSettings
from odeform.types import Basis, Floats, Geometry, Times, Vectors

if TYPE_CHECKING:
    from odeform.models.training.run import Run

__all__ = ["EXACT", "QUALITIES", "ModalModel"]

HEIGHTS = 2  # times of each trained frame at which it is looked up how low a body is
SPARE = 1e-3  # m above the depth from which on a motion counts as lost

QUALITIES = {
    "draft": SolverSettings("limex", tolerance=5e-4, dtype="float64"),
    "balanced": SolverSettings("limex", tolerance=1.5e-4, dtype="float64"),
    "reference": SolverSettings("limex", step=2.5e-4, dtype="float64"),
}
"""Of bodies whose solver errors were not measured."""
EXACT = SolverSettings("limex", step=1.25e-4, dtype="float64")
"""The reference for solver errors."""


class ModalModel(Model):
    """The motion of one elastic body on the floor that a projectile pushes."""

    model = "modal"
    made_of = (
        "mechanics: elastic modes of the body's own mesh, with ten fitted contact parameters for each object and no "
        "network; a kernel regression in the contact's frame adds what they leave unexplained"
    )
    together = 32
    accurate = QUALITIES["reference"]
    rescales_input = False
    fallback = SolverSettings("limex", step=2.5e-3, dtype="float64")
    finer = MappingProxyType({EXACT: 0.0})
    knows_objects = True
    resumable = True
    ablations: ClassVar[Mapping[str, str]] = {"correction": "what is left unexplained is not regressed"}

    @classmethod
    def train(cls, run: "Run") -> Checkpoint:
        from odeform.models.modal.training.fit import train_modal

        return train_modal(run)

    def _read(self, checkpoint: Checkpoint) -> None:
        config = checkpoint.config
        self.body = ElasticBody.from_parts(checkpoint.arrays, config["body"])
        self.law, self.pulse = ContactParameters(**config["law"]), float(config["pulse_s"])
        self.projectile = Projectile(**config["projectile"])
        shift, deformation = config["largest"]
        self._largest = float(shift), float(deformation)
        self._read_settings(config)
        self.qualities = self.qualities or QUALITIES
        if "correction" in config:
            self.residual = contact_residual(checkpoint.arrays, config["correction"])
        self._recent: Recent[tuple[ContactInputs, Vectors]] = Recent(1)

    # these take a moment, and not every object of a checkpoint is looked at

    @cached_property
    def mechanics(self) -> Mechanics:
        """The right-hand side of its ODE."""
        return Mechanics(self.body.reduced(), self.law, self.projectile)

    @cached_property
    def _coordinates(self) -> tuple[Coordinates, Basis]:
        return coordinates_of(self.body)

    @property
    def coordinates(self) -> Coordinates:
        """From states of the mechanics to reduced coordinates."""
        return self._coordinates[0]

    @cached_property
    def space(self) -> ReducedSpace:
        """That of its coordinates."""
        return space_of(self.body, self._coordinates[1], self._largest)

    def _pushed(self, theta: Float[np.ndarray, "batch parameters"]) -> tuple[ContactInputs, Vectors]:
        """What pushes at theta (B, P), relative to the mass centre, and the centres (B, 3) of the spheres."""

        def found() -> tuple[ContactInputs, Vectors]:
            values = [[p.denormalise(float(x)) for p, x in zip(self.schema.learned, row, strict=True)] for row in theta]
            contacts, forces = np.split(np.array(values), [3], axis=1)
            known = [checked_contact(self.rest, *one) for one in zip(contacts, forces, strict=True)]
            points, normals = (np.stack([getattr(point, name) for point, _ in known]) for name in ("point", "normal"))
            anchor, centres = self.body.anchor, np.stack([centre for _, centre in known])
            return ContactInputs(points - anchor, normals, forces), centres - anchor

        return self._recent.get(theta.tobytes(), found)

    def _push(self, theta: Float[np.ndarray, "batch parameters"]) -> Push:
        inputs, centres = self._pushed(theta)
        return make_push(self.mechanics.body, self.body.dynamic, inputs.contact, centres, inputs.force)

    def _readout(self, modes: Float[np.ndarray, "modes directions"]) -> Callable[[Times, Floats], Floats]:
        """That of states in the directions of deformation of one push."""
        coordinates = self.coordinates.along(modes)
        return lambda times, states: coordinates.reduced(*body_motion(states))

    def residual_inputs(self, theta: Floats) -> ContactInputs:
        return self._pushed(np.atleast_2d(theta))[0]

    def problem(self, theta: Floats, evaluated: EvaluatedBasis, dtype: type = np.float64) -> Problem:
        """Of one push, for theta (P,) in [-1, 1]; always in double precision."""
        push = self._push(theta[None])
        pushed = PushedBody(self.mechanics, push, self.pulse)
        return Problem(pushed, pushed.start, self._readout(push.modes[0]))

    def batch_problem(
        self, theta: Floats, geometry: Geometry, azimuths: Times, dtype: type
    ) -> Callable[[], BatchProblem]:
        def make() -> BatchProblem:
            push = self._push(theta)
            bodies = pushed_bodies(self.mechanics, push, self.pulse)
            readouts = [self._readout(modes) for modes in push.modes]

            def readout(times: Times, states: Floats) -> Floats:
                return np.stack([read(times, each) for read, each in zip(readouts, states, strict=True)])

            return BatchProblem(bodies, bodies.start, readout)

        return make

    def trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> Trajectory:
        motion = super().trajectory(theta, evaluated, settings, until)
        return Adjusted(motion, self._projection(motion))

    def batch_trajectory(
        self, geometry: Geometry, sets: Sequence[Parameters], settings: SolverSettings, until: float
    ) -> BatchTrajectory:
        motion = super().batch_trajectory(geometry, sets, settings, until)
        return AdjustedBatch(motion, self._projection(motion))

    def _projection(self, motion: Moving) -> FloorProjection:
        body, window = self.watched_body, self.schema.window
        grid = np.linspace(window.start, window.stop, HEIGHTS * round(window.stop * window.rate) + 1)
        return FloorProjection(motion, lambda y: body.sample(y, np.ones(len(y))).lowest, body.limit + SPARE, grid)
