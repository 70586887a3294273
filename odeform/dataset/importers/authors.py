"""The layout in which the paper's authors release their data: a folder a sequence, its shape and its offset apart.

<root>/train_folders.txt, val_folders.txt, test_folders.txt    a sequence folder a line
<root>/<seq>/params.json, metadata.json                        parameters; the offset of each frame
<root>/<seq>/xyz_meshes/<seq>_<k>.xyz, <seq>_<k>.ply           the shape in its own frame, and as a mesh
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from odeform.dataset.importers.naming import in_order, subfolders
from odeform.dataset.importers.source import Found, Source
from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.types import Faces, Floats, Frames, Mesh

__all__ = ["AUTHORS_MASS_ELASTIC", "RELEASED_CONTACT_FORCE", "authors_source", "is_authors_layout"]

AUTHORS_MASS_ELASTIC, RELEASED_CONTACT_FORCE = "released-mass-elastic", "released-contact-force"
PARAMETERS, OFFSETS, SHAPES = "params.json", "metadata.json", "xyz_meshes"
SPLITS = ("train", "val", "test")


@dataclass(frozen=True)
class _Kind:
    """One of the two released scenes: frames a second, and how its two JSON files are read."""

    scene: str
    rate: float
    mark: str
    """What its params.json has and the other's has not."""
    parameters: Callable[[Mapping[str, Any]], dict[str, float]]
    offsets: Callable[[Mapping[str, Any], int], Floats]
    units: Mapping[str, str]
    ratios: frozenset[str]
    note: str


def _heights(metadata: Mapping[str, Any], count: int) -> Floats:
    """(T, 3) metres; the last entries are the sequence."""
    heights = np.asarray(metadata["offset_z_vertices_list"], dtype=float).reshape(-1)
    if len(heights) < count:
        raise ValueError(f"{len(heights)} heights for {count} frames")
    return np.pad(heights[-count:, None], ((0, 0), (2, 0)))


def _shifts(metadata: Mapping[str, Any], count: int) -> Floats:
    """(T, 3) metres, one a frame."""
    shifts = np.asarray(metadata["rigid_pose_list"], dtype=float)
    if shifts.shape != (count, 3):
        raise ValueError(f"translations {shifts.shape} for {count} frames")
    return shifts


def _vector(name: str, values: Any) -> dict[str, float]:
    x, y, z = (float(value) for value in values)
    return {f"{name}_x": x, f"{name}_y": y, f"{name}_z": z}


KINDS = (
    _Kind(
        AUTHORS_MASS_ELASTIC,
        20.0,
        "mass",
        lambda p: {"mass": float(p["mass"]), "bending": float(p["soft_body_parameters"]["spring"]["bending"])},
        _heights,
        {"mass": "kg", "bending": "N m", "initial_offset": "m"},
        frozenset({"mass", "bending"}),
        "Time is the clock of the authors' simulation, 20 frames a second, not SI time.",
    ),
    _Kind(
        RELEASED_CONTACT_FORCE,
        10.0,
        "contact_vector",
        lambda p: _vector("contact", p["initial_location"]) | _vector("force", p["contact_vector"]),
        _shifts,
        {f"{name}_{axis}": unit for name, unit in (("contact", "m"), ("force", "N")) for axis in "xyz"}
        | {f"initial_offset_{axis}": "m" for axis in "xyz"},
        frozenset(),
        "Time is the clock of the authors' simulation, 10 frames a second.",
    ),
)


def is_authors_layout(root: Path) -> bool:
    return any((folder / PARAMETERS).is_file() for folder in subfolders(root))


def authors_source(root: Path) -> Source:
    """All sequences of a root. `InputError` in one line for what is missing or mixed."""
    names = [folder.name for folder in subfolders(root) if (folder / PARAMETERS).is_file()]
    splits = _splits(root, names)
    kind, sequences = None, []
    for name in splits or names:
        found, its = _found(root / name)
        if kind is not None and its is not kind:
            raise InputError(
                f"import {root}: {name} is of scene {its.scene}, others of {kind.scene}: import them apart"
            )
        kind = its
        sequences.append(replace(found, split=splits.get(name, "")))
    if kind is None:
        raise InputError(f"import {root}: no sequence in any of {', '.join(f'{s}_folders.txt' for s in SPLITS)}")
    made = {"imported": root.name, "layout": "released"}
    return Source(kind.scene, kind.rate, tuple(sequences), kind.units, kind.ratios, (kind.note,), made)


def _splits(root: Path, names: list[str]) -> dict[str, str]:
    """Sequence -> split, in the order of the files; empty if one of the files is missing."""
    files = {split: root / f"{split}_folders.txt" for split in SPLITS}
    if not all(file.is_file() for file in files.values()):
        return {}
    splits: dict[str, str] = {}
    for split, file in files.items():
        listed = [Path(line.strip()).name for line in file.read_text(errors="replace").splitlines() if line.strip()]
        if lost := [name for name in listed if name not in names]:
            raise InputError(
                f"import {file}: of {len(lost)} sequences there is no folder with {PARAMETERS}: {lost[0]} …"
            )
        if twice := [name for name in listed if name in splits]:
            raise InputError(f"import {file}: {twice[0]} is in split {splits[twice[0]]} already")
        splits |= dict.fromkeys(listed, split)
    return splits


def _json(path: Path) -> Mapping[str, Any]:
    try:
        content = json.loads(path.read_bytes())
    except OSError as error:
        raise InputError(f"import {path}: {error.strerror}") from None
    except ValueError:
        raise InputError(f"import {path}: not valid JSON") from None
    if not isinstance(content, dict):
        raise InputError(f"import {path}: expected an object with names, got {type(content).__name__}")
    return content


def _found(folder: Path) -> tuple[Found, _Kind]:
    raw = _json(folder / PARAMETERS)
    kind = next((kind for kind in KINDS if kind.mark in raw), None)
    if kind is None:
        marks = " or ".join(kind.mark for kind in KINDS)
        raise InputError(f"import {folder / PARAMETERS}: expected {marks}, got {', '.join(raw) or 'nothing'}")
    files = in_order((folder / SHAPES).glob("*.xyz"))
    where = folder / PARAMETERS
    try:
        parameters = kind.parameters(raw)
        where = folder / OFFSETS
        offsets = kind.offsets(_json(where), len(files))
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"import {where}: missing or wrong: {error}") from None
    if not files:
        raise InputError(f"import {folder / SHAPES}: expected a file .xyz a frame, found none")
    first = {f"initial_offset_{axis}": float(value) for axis, value in zip("xyz", offsets[0], strict=True)}
    if kind.scene == AUTHORS_MASS_ELASTIC:
        first = {"initial_offset": first["initial_offset_z"]}

    def read() -> tuple[Frames, Faces]:
        return _frames(files, offsets), _faces(folder, len(read_geometry(files[0]).points))

    return Found(folder.name, parameters | first, len(files), read), kind


def _frames(files: list[Path], offsets: Floats) -> Frames:
    """(T, N, 3) metres in the world."""
    shapes = [np.asarray(read_geometry(file).points, dtype=float) for file in files]
    for file, shape in zip(files, shapes, strict=True):
        if shape.shape != shapes[0].shape:
            raise InputError(f"import {file}: expected {len(shapes[0])} vertices as before, got {len(shape)}")
    return np.stack(shapes) + offsets[:, None]


def _faces(folder: Path, count: int) -> Faces:
    meshes = in_order(folder.glob("*.ply"))
    if not meshes:
        raise InputError(f"import {folder}: expected a mesh .ply of a frame, found none")
    mesh = read_geometry(meshes[0], merge=False)
    if not isinstance(mesh, Mesh) or len(mesh.points) != count:
        raise InputError(f"import {meshes[0]}: expected a mesh of {count} vertices, got {len(mesh.points)} points")
    return mesh.faces
