"""ODeform for bodies of known shape and material: the ODE is reduced mechanics, with few learned numbers."""

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.geometry.contact import checked_contact
from odeform.mechanics.law import MechanicalLaw
from odeform.mechanics.push import make_push
from odeform.mechanics.pushed import PushedBody
from odeform.mechanics.step import Mechanics, Projectile
from odeform.models.contact.inputs import ContactInputs
from odeform.models.frontier import FrontierPoint
from odeform.models.latent.latent_trajectory import LatentTrajectory
from odeform.models.modal.coordinates import Coordinates, coordinates_of, space_of
from odeform.models.modal.correction import Correction
from odeform.models.modal.elastic_body import ElasticBody
from odeform.models.reduced_model import ReducedModel
from odeform.motion.corrected_trajectory import CorrectedTrajectory
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.lifted_trajectory import LiftedTrajectory
from odeform.motion.reduced_motion import Trajectory
from odeform.motion.reduced_space import ReducedSpace
from odeform.solver.integrate import SolverSettings
from odeform.types import Basis, Floats

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
FALLBACK = SolverSettings("limex", step=2.5e-3, dtype="float64")
EXACT = SolverSettings("limex", step=1.25e-4, dtype="float64")
"""The reference for solver errors."""


class ModalModel(ReducedModel):
    """The motion of one elastic body on the floor that a projectile pushes."""

    model = "modal"
    accurate = QUALITIES["reference"]
    rescales_input = False
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
        chosen = {name: SolverSettings(**values) for name, values in config.get("qualities", {}).items()}
        self.qualities = chosen or QUALITIES
        self.frontier = tuple(FrontierPoint.from_json(row) for row in config.get("frontier", ()))
        self.correction = Correction(checkpoint.arrays, config["correction"]) if "correction" in config else None

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

    def trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> Trajectory:
        assert settings is not None
        values = [p.denormalise(float(x)) for p, x in zip(self.schema.learned, theta, strict=True)]
        contact, force = np.array(values[:3]), np.array(values[3:])
        point, centre = checked_contact(self.rest, contact, force)
        anchor = self.body.anchor
        push = make_push(
            self.mechanics.body, self.body.dynamic, point.point[None] - anchor, centre[None] - anchor, force[None]
        )
        pushed = PushedBody(self.mechanics, push, self.pulse)
        coordinates = self.coordinates.along(push.modes[0])

        def decode(times: Floats, states: Floats) -> Floats:
            return coordinates.reduced(*pushed.body_motion(states)[:3])

        radius = self.space.gyration_radius
        solved: Trajectory = LatentTrajectory(
            pushed,
            decode,
            pushed.start,
            settings,
            FALLBACK,
            until,
            radius,
            lambda: (pushed, pushed.start),
            {EXACT: 0.0},
        )
        if self.correction is not None:
            known = ContactInputs(point.point[None] - anchor, point.normal[None], force[None])
            rest = self.correction.over_time(known)
            solved = CorrectedTrajectory(solved, self.correction.kept, rest, self.correction.stop)
        body, window = self.watched_body, self.schema.window
        grid = np.linspace(window.start, window.stop, HEIGHTS * round(window.stop * window.rate) + 1)
        return LiftedTrajectory(solved, lambda y: body.sample(y, np.ones(len(y))).lowest, body.limit + SPARE, grid)
