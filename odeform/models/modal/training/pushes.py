"""Pushed bodies as training data: contacts and forces in, reduced motions out."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.geometry.contact import checked_contact
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.mechanics.motion import push_body
from odeform.mechanics.push import make_push
from odeform.mechanics.step import Mechanics, Projectile
from odeform.models.modal.coordinates import Coordinates, coordinates_of
from odeform.models.modal.elastic_body import ElasticBody
from odeform.motion.reduced_space import POSE, decompose
from odeform.types import Basis, Floats, Mesh, Perpoint, Vectors

__all__ = ["Pushes", "read_pushes"]


@dataclass(frozen=True, eq=False)
class Pushes:
    """S pushes of one body, from the split of a data set."""

    body: ElasticBody
    contacts: Vectors
    """(S, 3) m, relative to the mass centre at rest."""
    normals: Vectors
    """(S, 3) outward at the contacts."""
    centres: Vectors
    """(S, 3) m, of the projectile, relative to the mass centre."""
    forces: Vectors
    """(S, 3) N."""
    projectile: Projectile
    times: Floats
    """(T,) s."""
    reduced: Float[np.ndarray, "pushes times y"]
    """Shift, rotation vector and coefficients of the body's basis, m and radians."""
    left_out: Float[np.ndarray, "pushes times"]
    """Mean square deformation outside of the basis, m^2."""

    @property
    def scale(self) -> Floats:
        """(6 + K,) metres of RMS displacement by a unit of each coordinate."""
        arms = self.body.points - self.body.anchor
        radius = float(np.sqrt(self.body.weights @ (arms**2).sum(axis=1)))
        scale = np.ones(self.reduced.shape[2])
        scale[3:POSE] = radius * np.sqrt(2.0 / 3.0)
        return scale

    @property
    def fraction_left_out(self) -> float:
        """Fraction of the RMS deformation that the basis leaves out."""
        left = float(self.left_out.mean())
        total = left + float((self.reduced[..., POSE:] ** 2).sum(axis=2).mean())
        return float(np.sqrt(left / max(total, 1e-30)))

    def some(self, count: int, seed: int) -> "Pushes":
        """Returns `count` of them (or all), at random."""
        kept = np.random.default_rng(seed).permutation(len(self.contacts))[:count]
        names = ("contacts", "normals", "centres", "forces", "reduced", "left_out")
        return replace(self, **{name: getattr(self, name)[kept] for name in names})

    @cached_property
    def _coordinates(self) -> Coordinates:
        return coordinates_of(self.body)[0]

    def predicted(
        self, contact_parameters: ContactParameters, pulse: float, step: float
    ) -> Float[np.ndarray, "pushes times y"]:
        """Their motions by mechanics alone, in steps of `step` seconds, which divide the frames."""
        mechanics = Mechanics(self.body.reduced(), contact_parameters, self.projectile)
        push = make_push(mechanics.body, self.body.dynamic, self.contacts, self.centres, self.forces)
        nodes = push_body(mechanics, push, pulse, float(self.times[-1]), step)
        every = round(float(self.times[1] - self.times[0]) / step)
        kept = slice(0, every * (len(self.times) - 1) + 1, every)
        parts = zip(push.modes, nodes.shifts[:, kept], nodes.rotations[:, kept], nodes.amplitudes[:, kept], strict=True)
        return np.stack([self._coordinates.along(modes).reduced(*motion) for modes, *motion in parts])


def read_pushes(dataset: Dataset, split: str, body: ElasticBody) -> Pushes:
    """The pushes of one object, as they show at the vertices that have weight in the data.

    `InputError` for an empty split, or for another mesh than that of the body.
    """
    _, basis = coordinates_of(body)
    project = np.zeros(0), np.zeros((0, 0))
    mesh, rate = Mesh(body.points, body.faces), dataset.schema.window.rate
    rows: list[tuple[Floats, ...]] = []
    for recorded in dataset.sequences(split):
        sequence = recorded.frames(dataset.schema.window.stop, rate)
        if sequence.vertices.shape[1] != len(body.points):
            raise InputError(f"{sequence.name}: expected {len(body.points)} vertices, got {sequence.vertices.shape[1]}")
        given = sequence.parameters
        contact, force = (np.array([given[f"{name}_{axis}"] for axis in "xyz"]) for name in ("contact", "force"))
        point, centre = checked_contact(mesh, contact, force)
        pose, local = decompose(sequence, body.anchor, 0.0)
        if not np.array_equal(project[0], sequence.weights):
            project = sequence.weights, _projection(basis, sequence.weights)
        coefficients = local.reshape(len(local), -1) @ project[1]
        total = (local**2).sum(axis=2) @ sequence.weights
        left = np.maximum(total - (coefficients**2).sum(axis=1), 0.0)
        reduced = np.concatenate([pose, coefficients], axis=1)
        rows.append((point.point - body.anchor, point.normal, centre - body.anchor, force, reduced, left))
    if not rows:
        raise InputError(f"{dataset.root}: no sequence in split {split}")
    contacts, normals, centres, forces, reduced, left = (np.stack(column) for column in zip(*rows, strict=True))
    times = np.arange(reduced.shape[1]) / rate
    projectile = Projectile(dataset.fixed["projectile_radius_m"], dataset.fixed["projectile_mass_kg"])
    return Pushes(body, contacts, normals, centres, forces, projectile, times, reduced, left)


def _projection(basis: Basis, weights: Perpoint) -> Float[np.ndarray, "entries modes"]:
    """Maps displacements (3 N) to the coefficients of a basis (N, 3, K) that fit them best under the weights (N,)."""
    flat, each = basis.reshape(-1, basis.shape[2]), np.repeat(weights, 3)[:, None]
    return np.linalg.solve(flat.T @ (each * flat), (each * flat).T).T
