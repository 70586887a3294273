"""Stores, reads and solves all models that move each point by itself."""

from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from odeform.arrays import STEP, in_steps
from odeform.checkpoint import Checkpoint
from odeform.errors import InputError
from odeform.models.base import Predictor, check_finite
from odeform.models.layers import layer_shapes
from odeform.models.points.arithmetic import Net, Numpy
from odeform.models.points.point_network import PointNet
from odeform.models.points.point_trajectories import FramedPoints, MomentaryPoints
from odeform.motion.point_motion import MeanMotion, PointFrame, PointMotion, PointTrajectory, Probes, evaluate_probes
from odeform.motion.reduced_space import to_canonical
from odeform.schema import Parameters, Schema
from odeform.solver.integrate import SolverSettings
from odeform.types import Arrays, Floats, GaussianSplats, Geometry, MotionSequence, Points

if TYPE_CHECKING:
    from odeform.models.training.run import Run

__all__ = [
    "PREFIX",
    "PointModel",
    "PointPredictor",
    "frame_from_json",
    "frame_to_json",
    "point_checkpoint",
    "weights_in_steps",
]

PREFIX = "net."
FINENESS = 256
"""Steps to the RMS of a row of weights: the error of a motion changes by less than a hundredth."""


class PointPredictor(Predictor):
    """Predicts where each point of a mesh or a cloud goes, by itself."""

    frame: PointFrame
    mean: MeanMotion

    @cached_property
    def _probes(self) -> Probes:
        return evaluate_probes(self.rest, np.array(self.frame.anchor))

    @abstractmethod
    def _trajectories(
        self, bodies: Sequence[Floats], parameters: Parameters, observed: MotionSequence | None
    ) -> Iterator[PointTrajectory]:
        """The trajectories of each of `bodies`: points (N, 3) in metres about the anchor, canonical."""

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
        rest = to_canonical(geometry.points, np.array(self.frame.anchor), self.schema.azimuth(parameters))
        moved, body = self._trajectories((rest, self._probes.points), parameters, observed)
        frame, mean, probes = self.frame, self.mean, self._probes
        motion = PointMotion(self.schema, parameters, geometry, frame, mean, probes, moved, body, self.validity)
        motion.only_at = self.schema.window.stop if self.final_only else None
        return motion


class PointModel(PointPredictor):
    """A network that moves each point.

    A subclass sets `model`, its `network`, which `odeform train` trains, and the `trajectory` that evaluates it.
    """

    resumable = True
    descends = True
    network: PointNet
    trajectory: type[MomentaryPoints | FramedPoints]

    @classmethod
    def train(cls, run: "Run") -> Checkpoint:
        from odeform.models.points.training.fit import train_points

        return train_points(cls, run)

    def _read(self, checkpoint: Checkpoint) -> None:
        self.frame = frame_from_json(checkpoint.config["frame"])
        stored = {k: v for k, v in checkpoint.arrays.items() if k.startswith(PREFIX) and not k.endswith(STEP)}
        weights = {k.removeprefix(PREFIX): v for k, v in stored.items()}
        for name, shape in layer_shapes(self.network.sizes(len(self.schema.learned), checkpoint.config["width"])):
            if weights[name].shape != shape or not np.isfinite(weights[name]).all():
                raise ValueError(f"{name}: expected finite numbers of shape {shape}, got {weights[name].shape}")
        self.net = Net(weights, Numpy())
        self.mean = MeanMotion(checkpoint.arrays["mean.times"], checkpoint.arrays["mean.shifts"])

    def _trajectory(self, rest: Points, parameters: Parameters, observed: MotionSequence | None) -> PointTrajectory:
        """The trajectory of points (N, 3) in metres about the anchor, canonical."""
        inputs, theta = self.frame.inputs(rest), self.schema.inputs(parameters)
        return self.trajectory(self.net, self.network, self.frame, self.schema.window, inputs, theta)

    def _trajectories(
        self, bodies: Sequence[Floats], parameters: Parameters, observed: MotionSequence | None
    ) -> Iterator[PointTrajectory]:
        return (self._trajectory(points, parameters, observed) for points in bodies)


def frame_to_json(frame: PointFrame) -> dict[str, Any]:
    """The frame as JSON. Files call the radius of gyration `arm`."""
    values = asdict(frame)
    return {"arm": values.pop("gyration_radius"), **values}


def frame_from_json(data: Mapping[str, Any]) -> PointFrame:
    """The frame of a file; `KeyError`, `TypeError` or `ValueError` where something is missing or wrong."""
    values = dict(data)
    x, y, z = map(float, values.pop("anchor"))
    sizes = {name: float(value) for name, value in values.items()}
    if not np.isfinite([x, y, z]).all() or not all(0.0 < size < np.inf for size in sizes.values()):
        raise ValueError(f"frame: expected a finite anchor and positive lengths, got {dict(data)}")
    return PointFrame((x, y, z), sizes.pop("arm"), **sizes)


def weights_in_steps(weights: Arrays) -> Arrays:
    """Rounds matrices (R, C) to steps of 1 / `FINENESS` of the RMS of each row, and leaves biases as they are: ten bits
    for a weight in place of 32."""
    out: Arrays = {}
    for name, value in weights.items():
        values = np.asarray(value, dtype=float)
        if values.ndim == 2:
            out |= in_steps(name, values, np.sqrt(np.square(values).mean(axis=1)) / FINENESS)
        else:
            out[name] = values.astype(np.float32)
    return out


def point_checkpoint(
    model: str, schema: Schema, frame: PointFrame, mean: MeanMotion, weights: Arrays, config: dict[str, Any]
) -> Checkpoint:
    """The checkpoint of a point model, without the body that viewers show."""
    arrays = weights_in_steps({PREFIX + name: value for name, value in weights.items()})
    arrays |= {"mean.times": mean.times, "mean.shifts": mean.shifts}
    return Checkpoint(model, schema, {"frame": frame_to_json(frame), **config}, arrays)
