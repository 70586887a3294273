"""Shapes that no model was trained on, and their simulated motions: one file for each shape."""

import json
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.io import atomic_open
from odeform.parallel import parallel_map
from odeform.schema import OBJECT, Parameters
from odeform.simulation.contact_draws import contact_draws
from odeform.simulation.errors import SimulationError
from odeform.simulation.objects.files import arrays_of, object_of
from odeform.simulation.objects.materials import forces_at
from odeform.simulation.objects.soft_object import SoftObject
from odeform.simulation.objects.user_object import object_name
from odeform.simulation.scenes.contact_force import simulate_object
from odeform.simulation.user_data import body_in
from odeform.types import Geometry, MotionSequence

__all__ = [
    "BY_CODE",
    "INSTANCE",
    "LEFT_OUT",
    "SCAN",
    "UnseenShape",
    "by_code",
    "codes",
    "instance",
    "pushes_of",
    "scan",
    "shape_file",
    "simulated",
    "taught",
]

MOTIONS = 10  # of a shape that is simulated already
SPLITS = ("test", "val", "train")
INSTANCE, SCAN, BY_CODE, LEFT_OUT = "other instance", "scanned shape", "shape by code", "class left out"


@dataclass(frozen=True, eq=False)
class UnseenShape:
    """A soft body that a model was not trained on, and what the simulator does with it."""

    name: str
    kind: str
    """`INSTANCE`, `SCAN`, `BY_CODE` or `LEFT_OUT`."""
    like: str
    """The object whose material and forces it has."""
    item: SoftObject
    motions: tuple[MotionSequence, ...] = ()
    failed: tuple[str, ...] = ()
    """Reasons why simulations of further pushes have no motion."""


def instance(key: str, name: str, factors: Mapping[str, float]) -> UnseenShape:
    """A body of the class `name` with other proportions, called `key`; see `odeform_figures.bodies.generate`."""
    from odeform_figures.bodies.generate import generate  # looking at finished shapes needs no mesher

    return UnseenShape(key, INSTANCE, name, generate(name, factors=factors))


def scan(path: Path) -> UnseenShape:
    """The body of a mesh, points or splats, aligned automatically. `InputError` for a file that holds no solid."""
    return _placed(read_geometry(path), path.stem, SCAN)


def codes() -> dict[str, str]:
    """Names of shapes that are made by code, by names that a file can have."""
    from odeform_figures.bodies.hard import HARD

    return {object_name(name): name for name in HARD}


def by_code(key: str, name: str) -> UnseenShape:
    """The body of a shape of `codes`, called `key`. `InputError` for one that does not stand."""
    from odeform_figures.bodies.hard import HARD

    return _placed(HARD[name](), key, BY_CODE)


def taught(folder: Path) -> UnseenShape:
    """The body of a folder that `odeform simulate SCENE --geometry FILE` wrote, with its first motions."""
    dataset, body = open_dataset(folder), body_in(folder)
    if body is None:
        raise InputError(f"{folder}: expected motions of a shape of your own")
    window, finished = dataset.schema.window, [entry for split in SPLITS for entry in dataset.select(split)]
    motions = (dataset.read(entry).frames(window.stop, window.rate) for entry in finished[:MOTIONS])
    pushed = (replace(one, parameters={k: v for k, v in one.parameters.items() if k != OBJECT}) for one in motions)
    return UnseenShape(folder.name, SCAN, body.like, body.item, tuple(pushed))


def _placed(geometry: Geometry, name: str, kind: str) -> UnseenShape:
    from odeform.simulation.objects.from_mesh import placed_object
    from odeform.simulation.objects.settling import rested

    placed = placed_object(geometry, name)
    return UnseenShape(name, kind, placed.like, rested(placed.item))


def pushes_of(item: SoftObject, count: int, seed: int, own: bool = False) -> list[Parameters]:
    """Draws `count` contacts and forces on a body, as parameters of the scene: the same draw for every shape.

    On one of the user's `own` they are weaker where it is thin.
    """
    forces = partial(forces_at, item) if own else item.forces
    drawn = contact_draws(item.rest_mesh(), forces, count, [seed])
    named = [(("contact", contact), ("force", force)) for contact, force in drawn]
    return [
        {f"{key}_{axis}": float(x) for key, vector in push for axis, x in zip("xyz", vector, strict=True)}
        for push in named
    ]


def shape_file(folder: Path, name: str, count: int, seed: int) -> Path:
    """Names where the motions of a shape under `count` pushes are kept."""
    return folder / f"{name}.{count}-pushes.seed-{seed}.npz"


def simulated(
    path: Path, make: Callable[[], UnseenShape], count: int, seed: int, workers: int | None = None
) -> UnseenShape:
    """The shape that `make` returns with its motions, from the file `path`, or simulated and then written to it."""
    if path.exists():
        return _read(path)
    shape = make()
    pushes = pushes_of(shape.item, count, seed, shape.kind in (SCAN, BY_CODE))
    done = parallel_map(f"simulate {shape.name}", partial(_run, shape.item), pushes, workers)
    motions = tuple(motion for motion in done if isinstance(motion, MotionSequence))
    shape = replace(shape, motions=motions, failed=tuple(reason for reason in done if isinstance(reason, str)))
    _write(path, shape)
    return shape


def _run(item: SoftObject, parameters: Parameters) -> MotionSequence | str:
    try:
        return simulate_object(item, parameters)
    except SimulationError as error:
        return str(error)


def _write(path: Path, shape: UnseenShape) -> None:
    facts = {
        "name": shape.name,
        "kind": shape.kind,
        "like": shape.like,
        "parameters": [dict(motion.parameters) for motion in shape.motions],
        "failed": shape.failed,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    arrays: dict[str, Any] = {"facts": np.array(json.dumps(facts)), **arrays_of(shape.item)}
    for at, motion in enumerate(shape.motions):
        arrays |= {f"vertices.{at}": motion.vertices, f"times.{at}": motion.times}
    with atomic_open(path) as file:
        np.savez_compressed(file, **arrays)


def _read(path: Path) -> UnseenShape:
    try:
        with np.load(path, allow_pickle=False) as file:
            item, facts = object_of(file), json.loads(str(file["facts"]))
            motions = tuple(
                MotionSequence(file[f"times.{at}"], file[f"vertices.{at}"], item.faces, item.weights, parameters)
                for at, parameters in enumerate(facts["parameters"])
            )
        return UnseenShape(facts["name"], facts["kind"], facts["like"], item, motions, tuple(facts["failed"]))
    except (OSError, KeyError, ValueError, TypeError, zipfile.BadZipFile) as error:
        raise InputError(f"shape {path}: cannot be read ({error})") from None
