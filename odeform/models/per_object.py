"""One checkpoint of several: a model for each object of a scene, all of one kind.

The arrays of an object's model are named OBJECT/ARRAY; its settings, and its schema with the object's own ranges, stand
under its name in `config["objects"]`.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from odeform.checkpoint import Checkpoint, arrays_of_object
from odeform.loads.load import Load
from odeform.models.base import Predictor
from odeform.models.frontier import FrontierPoint
from odeform.motion.base import Motion
from odeform.motion.motion_batch import MotionBatch
from odeform.schema import OBJECT, Parameters, Schema
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Geometry, Mesh, MotionSequence

__all__ = ["PerObject", "is_per_object", "joined"]

COMMON = ("rest.points", "rest.faces")


def joined(schema: Schema, parts: Mapping[str, Checkpoint]) -> Checkpoint:
    """The checkpoint of several objects from one of each, by name; `PerObject` reads it.

    `schema` is that of the scene; the parts may have narrower ranges. The first object is the default: `rest.points`
    and `rest.faces` are its body.
    """
    first = next(iter(parts.values()))
    schema = replace(schema, window=first.schema.window, needs_observations=first.schema.needs_observations)
    arrays = {f"{name}/{key}": array for name, part in parts.items() for key, array in part.arrays.items()}
    arrays |= {key: first.arrays[key] for key in COMMON}
    arrays["training.theta"] = np.concatenate([_rescaled(part, schema) for part in parts.values()])
    return replace(
        first,
        schema=replace(schema, objects=tuple(parts)),
        config={
            "objects": {name: {"schema": part.schema.to_json(), **part.config} for name, part in parts.items()},
        },
        arrays=arrays,
        provenance={"objects": {name: part.provenance for name, part in parts.items()}},
    )


def _rescaled(part: Checkpoint, schema: Schema) -> Floats:
    """(S, P) the training parameters of a part in the ranges of `schema`."""
    learned, theta = part.schema.learned, part.arrays["training.theta"]
    values = [{p.name: p.denormalise(float(unit)) for p, unit in zip(learned, row, strict=True)} for row in theta]
    return np.array([schema.vector(row) for row in values], dtype=np.float32)


def is_per_object(checkpoint: Checkpoint) -> bool:
    """Whether a checkpoint has a model for each object."""
    return bool(checkpoint.schema.objects) and "objects" in checkpoint.config


class PerObject(Predictor):
    """Has the model of each object predict its motions: `parts`, by the object's name."""

    def __init__(self, checkpoint: Checkpoint, kind: type[Predictor]) -> None:
        """`kind` is the class of all parts. `InputError` for a damaged checkpoint."""
        self._kind = kind
        super().__init__(checkpoint)

    @property
    def _is_of_odeform(self) -> bool:
        return self._kind.__module__.partition(".")[0] == "odeform"

    def __reduce__(self) -> tuple[Any, ...]:
        return PerObject, (self.checkpoint, self._kind)

    def _read(self, checkpoint: Checkpoint) -> None:
        self.parts = {name: self._kind(_part(checkpoint, name)) for name in checkpoint.schema.objects}
        first = next(iter(self.parts.values()))
        self.model, self.made_of = self._kind.model, self._kind.made_of
        self.qualities, self.frontier = first.qualities, first.frontier
        self.rescales_input, self.extrapolates = first.rescales_input, first.extrapolates
        self.final_only, self.takes_loads = first.final_only, first.takes_loads

    def _solve(
        self,
        geometry: Geometry,
        parameters: Parameters,
        settings: SolverSettings | None,
        until: float,
        observed: MotionSequence | None,
    ) -> Motion:
        return self.parts[parameters[OBJECT]]._solve(geometry, parameters, settings, until, observed)

    def _solve_batch(
        self, geometry: Geometry, sets: list[dict[str, Any]], settings: SolverSettings | None, until: float
    ) -> MotionBatch:
        # the object is the same for all
        return self.parts[sets[0][OBJECT]]._solve_batch(geometry, sets, settings, until)

    def under_load(self, checkpoint: Checkpoint, load: Load) -> Checkpoint:  # pyright: ignore[reportIncompatibleMethodOverride]
        return self._kind.under_load(checkpoint, load)

    def of_same_kind(self, checkpoint: Checkpoint) -> Predictor:
        return PerObject(checkpoint, self._kind)

    def model_of(self, parameters: Parameters) -> Predictor:
        return self.parts[parameters[OBJECT]]

    def force_range(self, parameters: Mapping[str, Any]) -> tuple[float, float]:
        part = self.parts.get(parameters.get(OBJECT, ""))
        return super().force_range(parameters) if part is None else part.force_range(parameters)

    def settled(self, parameters: Mapping[str, Any]) -> Mesh:
        return self.parts[parameters[OBJECT]].settled(parameters)

    def frontier_of(self, parameters: Parameters) -> tuple[FrontierPoint, ...]:
        return self.parts[parameters[OBJECT]].frontier

    def shown(self, geometry: Geometry) -> Any:
        return next(iter(self.parts.values())).shown(geometry)

    def _qualities_of(self, parameters: Parameters) -> Mapping[str, SolverSettings]:
        return self.parts[parameters[OBJECT]].qualities

    def to_body_frame(self, geometry: Geometry, parameters: Mapping[str, Any]) -> Geometry:
        return self.parts[self.schema.complete(parameters)[OBJECT]].to_body_frame(geometry, parameters)


def _part(checkpoint: Checkpoint, name: str) -> Checkpoint:
    """The checkpoint of one object; `KeyError` where it is missing."""
    config = checkpoint.config["objects"][name]
    schema = Schema.from_json(config["schema"])
    return replace(checkpoint, schema=schema, config=config, arrays=arrays_of_object(checkpoint.arrays, name))
