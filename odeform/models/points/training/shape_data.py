"""Prepares what one network for all shapes is trained on: bodies, pushes and motions, in units of each body's size."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from odeform.dataset.index import Dataset
from odeform.dataset.subsampling import FrameSubsampling
from odeform.dataset.training_data import inputs_identity
from odeform.errors import InputError
from odeform.geometry.rigid import best_rigid
from odeform.models.contact.inputs import has_contact
from odeform.models.points.shape_inputs import Body, Ranges, body_of, descriptions
from odeform.models.points.training.point_data import displacements
from odeform.schema import Window
from odeform.simulation.contacts import CONTACT, FORCE, vector_of
from odeform.simulation.objects.catalog import OBJECTS, get_object
from odeform.types import Bools, Floats, Rotations

__all__ = ["BodyMotions", "ShapeData", "prepare_shapes"]


@dataclass(frozen=True, eq=False)
class BodyMotions:
    """S pushes of one body over T frames, in radii of gyration about its centre, in the scene's axes."""

    contact: Floats
    """(S, 3) m."""
    force: Floats
    """(S, 3) N."""
    moved: Floats
    """(S, T, N, 3) displacements, float32."""
    rotation: Rotations
    """(S, T, 3, 3) of the best rigid motion."""
    shift: Floats
    """(S, T, 3) of the best rigid motion, about the centre."""
    observed: Bools
    """(S, T) True where the frame is of the data, False where a spline fills it in."""
    spread: float
    """RMS displacement."""
    part_spread: float
    """RMS deformation."""
    largest: float
    """Largest displacement."""


@dataclass(frozen=True, eq=False)
class ShapeData:
    """Bodies by name, with their motions by split."""

    window: Window
    bodies: Mapping[str, Body]
    motions: Mapping[str, Mapping[str, BodyMotions]]
    """By split, then by body."""
    theta: Mapping[str, Floats]
    """(S, P) parameters of the training motions of each body in [-1, 1]."""
    identity: str
    """SHA-256 of all inputs."""

    @cached_property
    def ranges(self) -> Ranges:
        """Returns the ranges of the training motions."""
        return _ranges(self.bodies, self.motions["train"])

    def without(self, left_out: str) -> "ShapeData":
        """The same data without a body and all its motions."""
        kept = [name for name in self.bodies if name != left_out]
        return replace(
            self,
            bodies={name: self.bodies[name] for name in kept},
            motions={split: {name: found[name] for name in kept} for split, found in self.motions.items()},
            theta={name: self.theta[name] for name in kept},
            identity=f"{self.identity} without {left_out}",
        )


def prepare_shapes(dataset: Dataset, subsampling: FrameSubsampling | None = None) -> ShapeData:
    """Reads all training and validation sequences.

    `InputError` for a scene without objects or without pushes, and for objects whose mass is not known.
    """
    objects, schema = dataset.objects, dataset.schema
    if not objects or not has_contact(schema) or not set(objects) <= set(OBJECTS):
        raise InputError(f"odeform-shapes: expected pushes of {', '.join(OBJECTS)}, got a scene of other bodies")
    subsampling = subsampling or FrameSubsampling()
    count = subsampling.count(schema)
    bodies, theta = {}, {}
    motions: dict[str, dict[str, BodyMotions]] = {"train": {}, "val": {}}
    for name in objects:
        item, part = get_object(name), dataset.of(name)
        bodies[name] = body_of(next(part.sequences("train")).rest, item.mass, item.material.young)
        for split in motions:
            learned, motions[split][name] = _motions(part, split, bodies[name], subsampling, count)
            theta |= {name: learned} if split == "train" else {}
    window = Window(0.0, (count - 1) / schema.window.rate, schema.window.rate)
    identity = inputs_identity(dataset, subsampling, count, 1)
    return ShapeData(window, bodies, motions, theta, identity)


def _motions(
    dataset: Dataset, split: str, body: Body, subsampling: FrameSubsampling, count: int
) -> tuple[Floats, BodyMotions]:
    """The normalised parameters (S, P) and the motions of one body."""
    theta, moved = displacements(dataset, split, subsampling, count, body.centre, len(body.points))
    moved /= np.float32(body.gyration_radius)
    x = (body.points - body.centre) / body.gyration_radius
    rigid = [best_rigid(x, x + motion.astype(float), body.areas) for motion in moved]
    within = [
        np.square(motion - (x @ rotation.swapaxes(1, 2) + shift[:, None] - x)).mean()
        for motion, (rotation, shift) in zip(moved, rigid, strict=True)
    ]
    rotation, shift = (np.stack(parts) for parts in zip(*rigid, strict=True))
    rows = [entry.parameters for entry in dataset.select(split)]
    contact, force = (np.stack([vector_of(row, name) for row in rows]) for name in (CONTACT, FORCE))
    spread, part_spread = (
        float(np.sqrt(np.mean(squares))) for squares in ([np.square(m).mean() for m in moved], within)
    )
    largest = max(float(np.linalg.norm(motion, axis=-1).max()) for motion in moved)
    observed = subsampling.observed(count, len(rows))
    return theta, BodyMotions(contact, force, moved, rotation, shift, observed, spread, part_spread, largest)


def _ranges(bodies: Mapping[str, Body], motions: Mapping[str, BodyMotions]) -> Ranges:
    described = np.concatenate([descriptions(bodies[name], one.contact, one.force) for name, one in motions.items()])
    low, high = described.min(axis=0), described.max(axis=0)
    high = np.where(high > low, high, low + 1.0)  # of one body alone, its size is no range
    every = list(motions.values())
    spread, part_spread = (
        float(np.sqrt(np.mean(np.square([getattr(one, name) for one in every])))) for name in ("spread", "part_spread")
    )
    reach = max(
        float(np.linalg.norm(body.points - body.centre, axis=1).max()) / body.gyration_radius
        for body in bodies.values()
    )
    largest = max(one.largest for one in every)
    return Ranges(tuple(map(float, low)), tuple(map(float, high)), spread, part_spread, largest, reach)
