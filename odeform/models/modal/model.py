"""ODeform for bodies of known shape and material: the ODE is reduced mechanics, with few learned numbers."""

from collections.abc import Mapping
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.geometry.contact import checked_contact
from odeform.mechanics.law import MechanicalLaw
from odeform.mechanics.push import make_push
from odeform.mechanics.pushed import PushedBody
from odeform.mechanics.step import Mechanics, Projectile
from odeform.models.contact.inputs import ContactInputs
from odeform.models.modal.contact_residual import contact_residual
from odeform.models.modal.coordinates import Coordinates, coordinates_of, space_of
from odeform.models.modal.elastic_body import ElasticBody
from odeform.models.model import Model
from odeform.models.solved import Problem
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.floor_projection import FloorProjection
from odeform.motion.recent import Recent
from odeform.motion.reduced_space import ReducedSpace
from odeform.motion.trajectory import Adjusted, Trajectory
from odeform.solver.integrate import SolverSettings
from odeform.types import Basis, Floats, Times, Vector

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
        self.law, self.pulse = MechanicalLaw(**config["law"]), float(config["pulse_s"])
        self.projectile = Projectile(**config["projectile"])
        shift, deformation = config["largest"]
        self._largest = float(shift), float(deformation)
        self._read_settings(config)
        self.qualities = self.qualities or QUALITIES
        if "correction" in config:
            self.residual = contact_residual(checkpoint.arrays, config["correction"])
        self._recent: Recent[tuple[ContactInputs, Vector]] = Recent(1)

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

    def _pushed(self, theta: Floats) -> tuple[ContactInputs, Vector]:
        """What pushes at theta (P,), relative to the mass centre, and the centre (3,) of the sphere."""

        def found() -> tuple[ContactInputs, Vector]:
            values = [p.denormalise(float(x)) for p, x in zip(self.schema.learned, theta, strict=True)]
            contact, force = np.array(values[:3]), np.array(values[3:])
            point, centre = checked_contact(self.rest, contact, force)
            anchor = self.body.anchor
            return ContactInputs(point.point[None] - anchor, point.normal[None], force[None]), centre - anchor

        return self._recent.get(theta.tobytes(), found)

    def residual_inputs(self, theta: Floats) -> ContactInputs:
        return self._pushed(theta)[0]

    def problem(self, theta: Floats, evaluated: EvaluatedBasis, dtype: type = np.float64) -> Problem:
        """Of one push; always in double precision."""
        inputs, centre = self._pushed(theta)
        push = make_push(self.mechanics.body, self.body.dynamic, inputs.contact, centre[None], inputs.force)
        pushed, coordinates = PushedBody(self.mechanics, push, self.pulse), self.coordinates.along(push.modes[0])

        def readout(times: Times, states: Floats) -> Floats:
            return coordinates.reduced(*pushed.body_motion(states)[:3])

        return Problem(pushed, pushed.start, readout)

    def trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> Trajectory:
        motion, body = super().trajectory(theta, evaluated, settings, until), self.watched_body
        window = self.schema.window
        grid = np.linspace(window.start, window.stop, HEIGHTS * round(window.stop * window.rate) + 1)

        def lowest(y: Floats) -> Floats:
            return body.sample(y, np.ones(len(y))).lowest

        return Adjusted(motion, FloorProjection(motion, lowest, body.limit + SPARE, grid))
