"""The layout in which the paper's authors release their data: one folder per sequence, shapes and offsets separate.

<root>/train_folders.txt, val_folders.txt, test_folders.txt    one sequence folder per line
<root>/<seq>/params.json, metadata.json                        parameters; the offset of each frame
<root>/<seq>/xyz_meshes/<seq>_<k>.xyz, <seq>_<k>.ply           vertices in the body's frame; the mesh, for its faces
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from odeform.budget import read_limited
from odeform.dataset.importers.frame_names import numbered_frames
from odeform.dataset.importers.natural_order import naturally_sorted, subfolders
from odeform.dataset.importers.source import Source, SourceSequence
from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.io import parse_json
from odeform.types import Faces, Floats, Frames, Mesh

__all__ = ["AUTHORS_CONTACT_FORCE", "AUTHORS_MASS_ELASTIC", "authors_source", "is_authors_layout"]

AUTHORS_MASS_ELASTIC, AUTHORS_CONTACT_FORCE = "released-mass-elastic", "released-contact-force"
PARAMETERS, OFFSETS, SHAPES = "params.json", "metadata.json", "xyz_meshes"
LARGEST_JSON = 1 << 26  # bytes
SPLITS = ("train", "val", "test")


@dataclass(frozen=True)
class _Scene:
    """One of the two released scenes, and how its JSON files are read."""

    name: str
    rate: float
    """Frames per second, Hz."""
    key: str
    """The key of params.json that tells the scenes apart."""
    parameters: Callable[[Mapping[str, Any]], dict[str, float]]
    offsets: Callable[[Mapping[str, Any], int], Floats]
    units: Mapping[str, str]
    log_scaled: frozenset[str]
    note: str


def _heights(metadata: Mapping[str, Any], count: int) -> Floats:
    """(T, 3) metres; the last entries belong to the sequence, earlier ones precede it."""
    heights = np.asarray(metadata["offset_z_vertices_list"], dtype=float).reshape(-1)
    if len(heights) < count:
        raise ValueError(f"{len(heights)} heights for {count} frames")
    return np.pad(heights[-count:, None], ((0, 0), (2, 0)))


def _shifts(metadata: Mapping[str, Any], count: int) -> Floats:
    """(T, 3) metres, one translation per frame."""
    shifts = np.asarray(metadata["rigid_pose_list"], dtype=float)
    if shifts.shape != (count, 3):
        raise ValueError(f"translations {shifts.shape} for {count} frames")
    return shifts


def _vector(name: str, values: Any) -> dict[str, float]:
    x, y, z = (float(value) for value in values)
    return {f"{name}_x": x, f"{name}_y": y, f"{name}_z": z}


SCENES = (
    _Scene(
        AUTHORS_MASS_ELASTIC,
        20.0,
        "mass",
        lambda p: {"mass": float(p["mass"]), "bending": float(p["soft_body_parameters"]["spring"]["bending"])},
        _heights,
        {"mass": "kg", "bending": "N m", "initial_offset": "m"},
        frozenset({"mass", "bending"}),
        "Time is the clock of the authors' simulation, 20 frames per second, not SI time.",
    ),
    _Scene(
        AUTHORS_CONTACT_FORCE,
        10.0,
        "contact_vector",
        lambda p: _vector("contact", p["initial_location"]) | _vector("force", p["contact_vector"]),
        _shifts,
        {f"{name}_{axis}": unit for name, unit in (("contact", "m"), ("force", "N")) for axis in "xyz"}
        | {f"initial_offset_{axis}": "m" for axis in "xyz"},
        frozenset(),
        "Time is the clock of the authors' simulation, 10 frames per second.",
    ),
)


def is_authors_layout(root: Path) -> bool:
    """Whether any subfolder has the parameters of a sequence."""
    return any((folder / PARAMETERS).is_file() for folder in subfolders(root))


def authors_source(root: Path, rate: float | None = None) -> Source:
    """All sequences of a folder in this layout. Raises `InputError` if files are missing or scenes mixed, and for a
    `rate`: the scenes have theirs."""
    if rate is not None:
        raise InputError("import: --rate is for mesh frames: the authors' layout has its own")
    names = [folder.name for folder in subfolders(root) if (folder / PARAMETERS).is_file()]
    splits = _splits(root, names)
    scene, sequences = None, []
    for name in splits or names:
        sequence, its_scene = _sequence(root / name)
        if scene is not None and its_scene is not scene:
            raise InputError(
                f"import {root}: {name} is of scene {its_scene.name}, others of {scene.name}: import them separately"
            )
        scene = its_scene
        sequences.append(replace(sequence, split=splits.get(name, "")))
    if scene is None:
        raise InputError(f"import {root}: no sequence in any of {', '.join(f'{s}_folders.txt' for s in SPLITS)}")
    made = {"imported": root.name, "layout": "released"}
    return Source(scene.name, scene.rate, tuple(sequences), scene.units, scene.log_scaled, (scene.note,), made)


def _splits(root: Path, names: list[str]) -> dict[str, str]:
    """Sequence -> split, in the order of the files; empty if one of the files is missing."""
    files = {split: root / f"{split}_folders.txt" for split in SPLITS}
    if not all(file.is_file() for file in files.values()):
        return {}
    splits: dict[str, str] = {}
    for split, file in files.items():
        listed = [Path(line.strip()).name for line in file.read_text(errors="replace").splitlines() if line.strip()]
        if missing := [name for name in listed if name not in names]:
            raise InputError(
                f"import {file}: {len(missing)} listed sequences have no folder with {PARAMETERS}: {missing[0]} …"
            )
        if repeated := [name for name in listed if name in splits]:
            raise InputError(f"import {file}: {repeated[0]} is also in split {splits[repeated[0]]}")
        splits |= dict.fromkeys(listed, split)
    return splits


def _json(path: Path) -> Mapping[str, Any]:
    try:
        content = parse_json(read_limited(path, f"import {path}", LARGEST_JSON), f"import {path}")
    except OSError as error:
        raise InputError(f"import {path}: {error.strerror}") from None
    if not isinstance(content, dict):
        raise InputError(f"import {path}: expected a JSON object, got {type(content).__name__}")
    return content


def _sequence(folder: Path) -> tuple[SourceSequence, _Scene]:
    raw = _json(folder / PARAMETERS)
    scene = next((scene for scene in SCENES if scene.key in raw), None)
    if scene is None:
        keys = " or ".join(scene.key for scene in SCENES)
        raise InputError(f"import {folder / PARAMETERS}: expected {keys}, got {', '.join(raw) or 'nothing'}")
    files = naturally_sorted((folder / SHAPES).glob("*.xyz"))
    if len(files) > 1:
        files = list(numbered_frames(files, f"import {folder / SHAPES}").files)
    where = folder / PARAMETERS
    try:
        parameters = scene.parameters(raw)
        where = folder / OFFSETS
        offsets = scene.offsets(_json(where), len(files))
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"import {where}: missing or wrong: {error}") from None
    if not files:
        raise InputError(f"import {folder / SHAPES}: expected one .xyz file per frame, found none")
    first = {f"initial_offset_{axis}": float(value) for axis, value in zip("xyz", offsets[0], strict=True)}
    if scene.name == AUTHORS_MASS_ELASTIC:
        first = {"initial_offset": first["initial_offset_z"]}

    def read() -> tuple[Frames, Faces]:
        return _frames(files, offsets), _faces(folder, len(read_geometry(files[0]).points))

    return SourceSequence(folder.name, parameters | first, len(files), read, metric=True), scene


def _frames(files: list[Path], offsets: Floats) -> Frames:
    """(T, N, 3) metres in world axes."""
    shapes = [np.asarray(read_geometry(file).points, dtype=float) for file in files]
    for file, shape in zip(files, shapes, strict=True):
        if shape.shape != shapes[0].shape:
            raise InputError(f"import {file}: expected {len(shapes[0])} vertices as in frame 0, got {len(shape)}")
    return np.stack(shapes) + offsets[:, None]


def _faces(folder: Path, count: int) -> Faces:
    meshes = naturally_sorted(folder.glob("*.ply"))
    if not meshes:
        raise InputError(f"import {folder}: expected a .ply mesh of one frame, found none")
    mesh = read_geometry(meshes[0], merge=False)
    if not isinstance(mesh, Mesh) or len(mesh.points) != count:
        raise InputError(f"import {meshes[0]}: expected a mesh of {count} vertices, got {len(mesh.points)} points")
    return mesh.faces
