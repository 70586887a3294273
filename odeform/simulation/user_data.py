"""Motions of a user's own shape: its solid, and a data set of what the simulator does with it."""

import hashlib
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from odeform.dataset.folder import INDEX
from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.simulation.objects.materials import material_of
from odeform.simulation.objects.soft_object import SoftObject
from odeform.simulation.objects.user_object import UserObject, object_name, read_user_object, write_user_object
from odeform.simulation.runner import simulate
from odeform.simulation.scenes.user_object import scene_with
from odeform.types import Geometry

__all__ = ["body_in", "digest", "simulate_item", "simulate_shape"]


def simulate_shape(
    scene: str,
    geometry: str,
    out: str | Path,
    material: str | None = None,
    made: Callable[[UserObject], None] = lambda _: None,
    **settings: Any,
) -> Dataset:
    """Simulate motions of the shape in a file, under what happens in a scene of soft objects.

    The folder `out` keeps the body as `body.npz`. An interrupted run is continued with that body.

    Args:
        scene: "contact-force", or that of a load.
        geometry: A file of a mesh, points or splats, or the name of a bundled shape.
        out: Folder to write to.
        material: A name or KPA:DENSITY, see `odeform.simulation.objects.materials.material_of`; default: the softest
            under which the shape stands.
        made: Called with the body, before it is simulated.
        settings: Those of `odeform.simulation.runner.simulate`: `count`, `seed`, `workers`, `rate`, `step`.

    Raises:
        InputError: A shape that encloses no solid or does not stand; a folder with another data set.
    """
    from odeform.formats.bundled import moving_part, read_shape

    root = Path(out)
    path = Path(geometry)
    mark = hashlib.sha256(path.read_bytes()).hexdigest()[:16] if path.is_file() else geometry
    source = f"{mark}, {material or 'default material'}"
    body = body_in(root, source)
    if body is None:
        body = _kept(root, _made(moving_part(*read_shape(geometry)), object_name(geometry), material, source))
    made(body)
    return _simulated(scene, body, root, **settings)


def simulate_item(scene: str, item: SoftObject, like: str, out: str | Path, **settings: Any) -> Dataset:
    """Simulate motions of a soft object that is made already, as `simulate_shape` does.

    It rests first where the simulator has it rest. `InputError` for a folder with motions of another body.
    """
    from odeform.simulation.objects.settling import rested

    root, source = Path(out), digest(item)
    body = body_in(root, source)
    if body is None:
        body = _kept(root, UserObject(rested(replace(item, name=object_name(item.name))), like, source))
    return _simulated(scene, body, root, **settings)


def digest(item: SoftObject) -> str:
    """Returns a text that tells soft objects of other nodes or material apart."""
    material = replace(item.material, source="")
    about = f"{np.asarray(item.points, np.float32).tobytes().hex()} {item.elements.tolist()} {asdict(material)}"
    return hashlib.sha256(about.encode()).hexdigest()[:16]


def _simulated(scene: str, body: UserObject, root: Path, **settings: Any) -> Dataset:
    material = body.item.material
    made_of = {"source": body.source, "young_pa": material.young, "density": material.density, "like": body.like}
    return simulate(scene_with(scene, body.item), root, made_of=made_of, **settings)


def body_in(root: Path, source: str | None = None) -> UserObject | None:
    """The body of a folder; None if it holds none yet.

    `InputError` for one that was not made of `source`, if that is given, or for a data set without one.
    """
    body = read_user_object(root)
    if body is None and (root / INDEX).exists():
        raise InputError(f"{root}: holds a data set without a body of its own; expected another or an empty folder")
    if body is not None and source is not None and body.source != source:
        raise InputError(
            f"{root}: holds motions of {body.item.name} from another file or of another material; expected an empty "
            "folder"
        )
    return body


def _kept(root: Path, body: UserObject) -> UserObject:
    """The body as the folder holds it: rounded, as a continued run reads it."""
    write_user_object(root, body)
    kept = read_user_object(root)
    assert kept is not None
    return kept


def _made(geometry: Geometry, name: str, material: str | None, source: str) -> UserObject:
    from odeform.simulation.objects.from_mesh import placed_object
    from odeform.simulation.objects.settling import rested

    given = None if material is None else material_of(material)
    placed = placed_object(geometry, name, material=given)
    notes = "; ".join((placed.describe(), *geometry.notes))
    return UserObject(rested(placed.item), placed.like, source, notes)
