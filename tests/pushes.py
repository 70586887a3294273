"""A data set of two bodies that are pushed at a point of their surface, by a formula: bodies shift, turn and dent."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from odeform.dataset.folder import folder_reader, save_sequence, write_index
from odeform.dataset.index import Dataset, Entry, assign_splits_in_blocks
from odeform.geometry.primitives import octasphere
from odeform.geometry.rigid import rotation_from_vector
from odeform.geometry.shape import surface_weights
from odeform.schema import Parameter, Schema, Window
from odeform.types import Mesh, MotionSequence

AXES = "xyz"
SCHEMA = Schema(
    scene="pushes",
    parameters=(
        *(Parameter(f"contact_{axis}", "m", -0.2, 0.2, 0.0) for axis in AXES),
        *(Parameter(f"force_{axis}", "N", -10.0, 10.0, 1.0) for axis in AXES),
    ),
    window=Window(0.0, 0.1, 100.0),
    objects=("egg", "plate"),
)
BODIES = {"egg": (2, (0.04, 0.04, 0.08)), "plate": (3, (0.1, 0.1, 0.02))}  # segments, half axes in m
FINER = 4  # times the frames of a test sequence


def body(name: str) -> Mesh:
    """An ellipsoid on the floor."""
    segments, axes = BODIES[name]
    sphere = octasphere(1.0, segments)
    points = np.asarray(sphere.points * np.array(axes))
    return Mesh((points + np.array([0.0, 0.0, axes[2]])).astype(np.float32), sphere.faces)


def parameters(name: str, count: int, seed: int) -> list[dict]:
    """Contacts at vertices, pushed towards the centre and to a side."""
    rng, mesh = np.random.default_rng(seed), body(name)
    centre, drawn = mesh.points.mean(axis=0), []
    for _ in range(count):
        contact = mesh.points[rng.integers(len(mesh.points))].astype(float)
        inward = (centre - contact) / np.linalg.norm(centre - contact)
        force = rng.uniform(2.0, 6.0) * (inward + 0.4 * rng.uniform(-1.0, 1.0, 3))
        values = zip(SCHEMA.learned, [*contact, *force], strict=True)
        drawn.append({"object": name, **{p.name: float(value) for p, value in values}})
    return drawn


def motion(given: dict, rate: float) -> MotionSequence:
    """The body shifts along the force, turns about its arm, and dents around the contact."""
    mesh = body(given["object"])
    times = np.arange(round(0.1 * rate) + 1) / rate
    contact, force = (np.array([given[f"{kind}_{axis}"] for axis in AXES]) for kind in ("contact", "force"))
    rest = mesh.points.astype(float)
    centre = rest.mean(axis=0)
    depth = np.sin(np.pi * times / 0.1) ** 2
    near = np.exp(-((np.linalg.norm(rest - contact, axis=1) / 0.03) ** 2))
    local = rest - centre + 1e-3 * depth[:, None, None] * near[:, None] * force
    turn = rotation_from_vector(20.0 * times[:, None] ** 2 * np.cross(contact - centre, force))
    vertices = local @ turn.swapaxes(1, 2) + centre + times[:, None, None] ** 2 * force
    return MotionSequence(times, vertices.astype(np.float32), mesh.faces, surface_weights(mesh), dict(given))


def pushes(count: int = 20, seed: int = 0) -> Dataset:
    """`count` sequences of each body, in memory."""
    held: dict[str, MotionSequence] = {}
    entries = []
    for name in SCHEMA.objects:
        splits = assign_splits_in_blocks(count, 0, count)
        for index, given in enumerate(parameters(name, count, seed)):
            entry = Entry(f"pushes_{name}_{index:05d}", splits[index], given, sha256=f"{name}{index}")
            rate = SCHEMA.window.rate * (FINER if entry.split == "test" else 1)
            sequence = motion(given, rate)
            held[entry.name] = MotionSequence(
                sequence.times, sequence.vertices, sequence.faces, sequence.weights, given, entry.name
            )
            entries.append(entry)
    return Dataset(Path("pushes"), SCHEMA, tuple(entries), lambda entry: held[entry.name])


def in_folder(dataset: Dataset, root: Path) -> Dataset:
    """The same sequences in a folder."""
    entries = tuple(replace(e, sha256=save_sequence(root, e.name, dataset.read(e))) for e in dataset.entries)
    kept = replace(dataset, root=root, entries=entries, read=folder_reader(root))
    write_index(kept)
    return kept
