"""ODeform for bodies of known shape and material: the ODE is reduced mechanics, with few learned numbers."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from jaxtyping import Float

from odeform.checkpoint import Checkpoint
from odeform.geometry.contact import checked_contact
from odeform.mechanics.law import MechanicalLaw
from odeform.mechanics.push import Push, make_push
from odeform.mechanics.pushed import PushedBody, body_motion
from odeform.mechanics.pushed_batch import PushedBodies
from odeform.mechanics.step import Mechanics, Projectile
from odeform.models.contact.inputs import ContactInputs
from odeform.models.frontier import FrontierPoint
from odeform.models.latent.inference import Decoder
from odeform.models.latent.latent_trajectory import LatentTrajectory
from odeform.models.modal.coordinates import Coordinates, coordinates_of, space_of
from odeform.models.modal.correction import Correction
from odeform.models.modal.elastic_body import ElasticBody
from odeform.models.reduced_batches import CorrectedBatch, LiftedBatch
from odeform.models.reduced_model import ReducedModel
from odeform.models.solved_batch import BatchProblem, SolvedBatch
from odeform.motion.corrected_trajectory import CorrectedTrajectory
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.lifted_trajectory import LiftedTrajectory, floor_lift
from odeform.motion.reduced_batch import BatchTrajectory
from odeform.motion.reduced_motion import Trajectory
from odeform.motion.reduced_space import ReducedSpace
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
FALLBACK = SolverSettings("limex", step=2.5e-3, dtype="float64")
EXACT = SolverSettings("limex", step=1.25e-4, dtype="float64")
"""The reference for solver errors."""


class ModalModel(ReducedModel):
    """The motion of one elastic body on the floor that a projectile pushes."""

    model = "modal"
    together = 32
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
        known, centres = self._contacts(theta[None])
        push = self._push(known, centres)
        pushed = PushedBody(self.mechanics, push, self.pulse)
        decode, radius = self._decoder(push.modes[0]), self.space.gyration_radius
        precise = pushed, pushed.start
        solved: Trajectory = LatentTrajectory(
            pushed, decode, pushed.start, settings, FALLBACK, until, radius, lambda: precise, {EXACT: 0.0}
        )
        if self.correction is not None:
            rest = self.correction.over_time(known)
            solved = CorrectedTrajectory(solved, self.correction.kept, rest, self.correction.stop)
        return LiftedTrajectory(solved, self._lowest, self.watched_body.limit + SPARE, self._grid)

    def batch_trajectory(
        self, geometry: Geometry, sets: Sequence[Parameters], settings: SolverSettings, until: float
    ) -> BatchTrajectory:
        known, centres = self._contacts(self.schema.batch_inputs(sets))

        def make() -> BatchProblem:
            push = self._push(known, centres)
            decoders = [self._decoder(modes) for modes in push.modes]

            def readout(times: Times, states: Floats) -> Floats:
                return np.stack([decode(times, each) for decode, each in zip(decoders, states, strict=True)])

            bodies = PushedBodies(self.mechanics, push, self.pulse)
            return BatchProblem(bodies, bodies.start, readout)

        motion: BatchTrajectory = SolvedBatch(make, settings, until)
        if self.correction is not None:
            rest = self.correction.over_times(known)
            motion = CorrectedBatch(motion, self.correction.kept, rest, self.correction.stop)
        limit = self.watched_body.limit + SPARE
        return LiftedBatch(motion, lambda y: floor_lift(self._lowest(y), limit), self._grid)

    def _contacts(self, theta: Float[np.ndarray, "batch parameters"]) -> tuple[ContactInputs, Vectors]:
        """Contacts, normals and forces of pushes theta (B, P), and centres (B, 3) of the spheres; m relative to the
        mass centre."""
        values = np.array(
            [[p.denormalise(float(x)) for p, x in zip(self.schema.learned, row, strict=True)] for row in theta]
        )
        contacts, forces = values[:, :3], values[:, 3:]
        found = [checked_contact(self.rest, *each) for each in zip(contacts, forces, strict=True)]
        anchor = self.body.anchor
        points, normals = (np.stack([getattr(point, name) for point, _ in found]) for name in ("point", "normal"))
        return ContactInputs(points - anchor, normals, forces), np.stack([centre for _, centre in found]) - anchor

    def _push(self, known: ContactInputs, centres: Vectors) -> Push:
        return make_push(self.mechanics.body, self.body.dynamic, known.contact, centres, known.force)

    def _decoder(self, modes: Float[np.ndarray, "modes directions"]) -> Decoder:
        """That of states in the directions of deformation of one push."""
        coordinates = self.coordinates.along(modes)
        return lambda times, states: coordinates.reduced(*body_motion(states))

    @cached_property
    def _grid(self) -> Times:
        """(G,) s: times at which it is looked up how low a body is."""
        window = self.schema.window
        return np.linspace(window.start, window.stop, HEIGHTS * round(window.stop * window.rate) + 1)

    def _lowest(self, y: Float[np.ndarray, "times y"]) -> Times:
        """(T, 6 + K) -> (T,) heights in m of the body's lowest point."""
        return self.watched_body.sample(y, np.ones(len(y))).lowest
