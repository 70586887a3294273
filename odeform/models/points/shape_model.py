"""One network for all bodies of a scene: it reads the shape that it moves, trained or not."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from odeform.arrays import STEP
from odeform.checkpoint import Checkpoint
from odeform.errors import InputError
from odeform.models.base import Predictor, check_finite
from odeform.models.layers import layer_shapes
from odeform.models.points.arithmetic import Net, Numpy
from odeform.models.points.point_model import PREFIX
from odeform.models.points.shape_inputs import Body, Ranges, body_of, descriptions, turns_to_force
from odeform.models.points.shape_network import ShapeNet, point_features
from odeform.models.points.shape_trajectory import ShapePush, ShapeTrajectory
from odeform.motion.point_motion import MeanMotion, PointMotion, evaluate_probes
from odeform.schema import OBJECT, Parameters
from odeform.simulation.contacts import CONTACT, FORCE, vector_of
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, GaussianSplats, Geometry, Mesh, MotionSequence

if TYPE_CHECKING:
    from odeform.models.training.run import Run

__all__ = ["Matter", "ShapeModel"]


@dataclass(frozen=True)
class Matter:
    """What no shape tells of a body."""

    mass: float
    """kg."""
    young: float
    """Pa, Young's modulus."""


class ShapeModel(Predictor):
    """The paper's network with a latent state of the whole body, trained on several bodies at once.

    The shape is that of the geometry which is asked for; mass and stiffness are those of the object in the parameters.
    """

    model = "odeform-shapes"
    made_of = (
        "neural networks: encoders that read the cloud of points, two latent neural ODEs, and decoders to a rigid "
        "motion and to points; one for all bodies"
    )
    knows_objects = True
    resumable = True
    descends = True
    network = ShapeNet()

    @classmethod
    def train(cls, run: "Run") -> Checkpoint:
        from odeform.models.points.training.shape_fit import train_shapes

        return train_shapes(run)

    def _read(self, checkpoint: Checkpoint) -> None:
        stored = {k: v for k, v in checkpoint.arrays.items() if k.startswith(PREFIX) and not k.endswith(STEP)}
        weights = {k.removeprefix(PREFIX): v for k, v in stored.items()}
        for name, shape in layer_shapes(self.network.sizes(checkpoint.config["width"])):
            if weights[name].shape != shape or not np.isfinite(weights[name]).all():
                raise ValueError(f"{name}: expected finite numbers of shape {shape}, got {weights[name].shape}")
        self.net = Net(weights, Numpy())
        self.ranges = Ranges.from_json(checkpoint.config["ranges"])
        self.matter = {name: Matter(**checkpoint.config["bodies"][name]) for name in self.schema.objects}
        numbers = [value for each in self.matter.values() for value in (each.mass, each.young)]
        if not numbers or not all(0.0 < float(number) < np.inf for number in numbers):
            raise ValueError("bodies: expected the mass and the stiffness of at least one")

    @cached_property
    def mean(self) -> MeanMotion:
        """Returns the motion that predictions are added to: none, since that of another shape is not known."""
        return MeanMotion(np.array([0.0, self.schema.window.stop]), np.zeros((2, 3)))

    def with_body(self, name: str, rest: Mesh, mass: float, young: float) -> "ShapeModel":
        """The same network with one body more, which it may not have been trained on.

        Args:
            name: What it is called in parameters.
            rest: Its surface at rest on the floor, N vertices in metres.
            mass: kg.
            young: Young's modulus, Pa.

        Raises:
            InputError: A name that another body has, or a mass or stiffness that is not positive.
        """
        if name in self.schema.objects:
            raise InputError(f"body {name!r}: there is one of that name")
        if not (0.0 < mass < np.inf and 0.0 < young < np.inf):
            raise InputError(f"body {name!r}: expected a positive mass and stiffness, got {mass:g} kg and {young:g} Pa")
        known, matter = self.checkpoint, {"mass": mass, "young": young}
        return type(self)(
            replace(
                known,
                schema=replace(known.schema, objects=(*known.schema.objects, name)),
                config={**known.config, "bodies": {**known.config["bodies"], name: matter}},
                arrays={**known.arrays, f"{name}/rest.points": rest.points, f"{name}/rest.faces": rest.faces},
            )
        )

    def push(self, body: Body, parameters: Parameters) -> ShapePush:
        """What the encoders make of a body and a push."""
        contact, force = (vector_of(parameters, name)[None] for name in (CONTACT, FORCE))
        conditions = self.ranges.bounded(descriptions(body, contact, force))
        turn, near = turns_to_force(force)[0], self.ranges.denormalised(conditions)[:, :3].astype(np.float32)
        cloud = body.frame(self.ranges).inputs(body.points - body.centre) @ turn.T.astype(np.float32)
        seen = point_features(self.net, cloud[None], near)
        areas = body.areas[None].astype(np.float32)
        first = self.network.encode(self.net, seen, areas, conditions.astype(np.float32))
        return ShapePush(first, near[0], turn)

    def _solve(
        self,
        geometry: Geometry,
        parameters: Parameters,
        settings: SolverSettings | None,
        until: float,
        observed: MotionSequence | None,
    ) -> PointMotion:
        check_finite(geometry)
        if isinstance(geometry, GaussianSplats):
            raise InputError(f"{self.model}: cannot deform splats; expected a mesh or points")
        matter = self.matter[parameters[OBJECT]]
        body = body_of(geometry, matter.mass, matter.young)
        frame, push = body.frame(self.ranges), self.push(body, parameters)
        probes = evaluate_probes(geometry, body.centre)
        parts = (geometry.points - body.centre, probes.points)
        moved, shown = (self._trajectory(part, frame, push) for part in parts)
        mean, validity = self.mean, self.validity
        return PointMotion(self.schema, parameters, geometry, frame, mean, probes, moved, shown, validity)

    def _trajectory(self, points: Floats, frame: Any, push: ShapePush) -> ShapeTrajectory:
        return ShapeTrajectory(self.net, self.network, frame, self.schema.window, frame.inputs(points), push)
