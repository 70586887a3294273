"""The readers, and how a damaged input of each is made and used. A use returns, or raises `InputError`."""

import hashlib
import json
import lzma
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import odeform
from odeform.checkpoint import bundled_checkpoints
from odeform.dataset.captured import read_captured
from odeform.dataset.importers.registry import import_dataset
from odeform.dataset.store import open_dataset
from odeform.formats.bundled import read_shape
from odeform.formats.writing import write_motion
from odeform.geometry.shape import fit_to
from odeform.motion.recorded import RecordedMotion
from odeform_viz.columns import Column, Columns
from odeform_viz.state import capture, state_from_json, state_to_json
from odeform_viz.view import DisplayOptions, ViewRequest

from .corpus import dataset, shapes
from .mutations import Random, mutated, mutated_json
from .sequences import SEQUENCES

__all__ = ["TARGETS", "Target"]

MODEL = "mass-elastic/pod-rbf"
MODELS = ("mass-elastic/pod-rbf", "mass-elastic/odeform", "mass-elastic/direct", "mass-elastic/gp")


@dataclass(frozen=True)
class Target:
    """`make(folder, random)` writes a damaged input below a folder, and returns its path; `use(path)` reads it."""

    name: str
    make: Callable[[Path, Random], Path]
    use: Callable[[Path], None]


@cache
def _model() -> Any:
    return odeform.load(MODEL)


@cache
def _shapes() -> dict[str, bytes]:
    return shapes()


def _finite(array: Any) -> None:
    if not np.isfinite(array).all():
        raise AssertionError("the output is not finite")


def _shape(name: str) -> Target:
    def make(folder: Path, random: Random) -> Path:
        path = folder / name
        path.write_bytes(mutated(_shapes()[name], random))
        if random.random() < 0.1:
            region = {"sphere": {"centre": [0, 0, 0], "radius": 1}}
            path.with_suffix(".region.json").write_bytes(mutated_json(region, random))
        return path

    return Target(name, make, _move)


def _move(path: Path) -> None:
    """As `odeform predict --geometry` does."""
    shape, region = read_shape(path)
    fit = fit_to(shape, _model().rest, region)
    out = path.parent / "out.npz"
    write_motion(_model().solve(fit.geometry), np.array([0.0, 0.2]), out, fit)
    with np.load(out) as arrays:
        for name in {"vertices", "centers", "covariances"} & set(arrays):
            _finite(arrays[name])


def _checkpoint(name: str) -> Target:
    def make(folder: Path, random: Random) -> Path:
        path = folder / "model.safetensors"
        data = bundled_checkpoints()[name].read_bytes()
        length = int.from_bytes(data[:8], "little")
        if random.random() < 0.5:
            header = json.loads(data[8 : 8 + length])
            meta = json.loads(header["__metadata__"]["odeform"])
            header["__metadata__"]["odeform"] = mutated_json(meta, random).decode()
            text = json.dumps(header).encode() if random.random() < 0.7 else mutated_json(header, random)
            data = len(text).to_bytes(8, "little") + text + data[8 + length :]
        else:
            data = mutated(data, random)
        path.write_bytes(data)
        return path

    return Target(f"checkpoint {name}", make, _predict)


def _predict(path: Path) -> None:
    motion = odeform.load(path).solve()
    out = path.parent / "out.npz"
    write_motion(motion, np.array([0.0, 0.2]), out)
    with np.load(out) as arrays:
        _finite(arrays["vertices"])


def _authors(folder: Path, random: Random) -> Path:
    import torch

    from odeform.models.authors.file import PARTS

    path = folder / "model.pth"
    state = {f"encoder.{k}.weight": torch.ones(3, 4) for k in range(3)}
    torch.save({**dict.fromkeys(PARTS.values(), state), "args": {"fps": 20}}, path)
    path.write_bytes(mutated(path.read_bytes(), random))
    return path


@cache
def _datasets() -> tuple[dict[str, bytes], bytes]:
    """The files of a data set by name, and the packed one."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "data"
        dataset(root)
        return {file.name: file.read_bytes() for file in root.iterdir()}, root.with_suffix(".odp").read_bytes()


def _folder(folder: Path, random: Random) -> Path:
    """Damaged sequences with matching checksums, or a damaged index."""
    root = folder / "data"
    root.mkdir()
    for name, data in _datasets()[0].items():
        (root / name).write_bytes(data)
    index = json.loads((root / "dataset.json").read_bytes())
    if random.random() < 0.6:
        file = root / "s0.npz"
        file.write_bytes(mutated(file.read_bytes(), random))
        index["sequences"][0]["sha256"] = hashlib.sha256(file.read_bytes()).hexdigest()
        (root / "dataset.json").write_text(json.dumps(index))
    else:
        (root / "dataset.json").write_bytes(mutated_json(index, random))
    return root


def _packed(folder: Path, random: Random) -> Path:
    """A damaged member in a sound archive, or a damaged archive."""
    path = folder / "data.odp"
    path.write_bytes(_datasets()[1])
    if random.random() < 0.3:
        path.write_bytes(mutated(path.read_bytes(), random))
        return path
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = list(members)[random.integers(len(members))]
    if name == "dataset.json":
        members[name] = lzma.compress(mutated_json(json.loads(lzma.decompress(members[name])), random))
    else:
        members[name] = mutated(members[name], random)
        index = json.loads(lzma.decompress(members["dataset.json"]))
        for entry in index["sequences"]:
            entry["sha256"] = hashlib.sha256(members[entry["name"]]).hexdigest()
        members["dataset.json"] = lzma.compress(json.dumps(index).encode())
    with zipfile.ZipFile(path, "w") as archive:
        for member, data in members.items():
            archive.writestr(member, data)
    return path


def _read_all(path: Path) -> None:
    for sequence in open_dataset(path).sequences("all"):
        _finite(sequence.vertices)


def _table(folder: Path, random: Random) -> Path:
    root = folder / "frames"
    for name in ("a", "b"):
        (root / name).mkdir(parents=True)
        for frame in range(2):
            (root / name / f"{frame}.obj").write_bytes(_shapes()["mesh.obj"])
    if random.random() < 0.2:
        (root / "a" / "1.obj").write_bytes(mutated(_shapes()["mesh.obj"], random))
    rows = [{"sequence": name, "mass (kg)": mass, "rate": 20} for name, mass in (("a", 1), ("b", 2))]
    if random.random() < 0.5:
        (root / "parameters.json").write_bytes(mutated_json(rows, random))
    else:
        table = b"sequence,mass (kg),split,rate\na,1,train,20\nb,2,test,20\n"
        (root / "parameters.csv").write_bytes(mutated(table, random))
    return root


def _import(path: Path) -> None:
    _read_all(import_dataset(path, path.parent / "out").root)


def _state(folder: Path, random: Random) -> Path:
    model = _model()
    columns = Columns.of([Column("model", model, model.rest, origin=MODEL)]).all
    request = ViewRequest(model.schema.complete({}), 0.1, "balanced", columns)
    raw = json.loads(state_to_json(capture(model.schema.scene, request, DisplayOptions())))
    path = folder / "state.json"
    path.write_bytes(mutated_json(raw, random))
    return path


def _restore(path: Path) -> None:
    state_from_json(path.read_bytes(), _model().schema.scene)


def _captured(folder: Path, random: Random) -> Path:
    """Damaged arrays in a sound archive, or a damaged archive."""
    path = folder / "captured.npz"
    model = _model()
    write_motion(model.solve(), np.linspace(0.0, 0.5, 4), path)
    if random.random() < 0.3:
        path.write_bytes(mutated(path.read_bytes(), random))
        return path
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = list(members)[random.integers(len(members))]
    members[name] = mutated(members[name], random)
    with zipfile.ZipFile(path, "w") as archive:
        for member, data in members.items():
            archive.writestr(member, data)
    return path


def _open(path: Path) -> None:
    model = _model()
    sequence = read_captured(path.read_bytes(), path.name, model.schema, model.rest)
    motion = RecordedMotion(model.schema, sequence)
    _finite(motion.vertices(np.linspace(0.0, 0.5, 3)))
    _finite(motion.pose(0.1))


TARGETS = (
    *(_shape(name) for name in shapes()),
    *(_checkpoint(name) for name in MODELS),
    Target("authors' checkpoint", _authors, _predict),
    Target("folder", _folder, _read_all),
    Target("packed", _packed, _read_all),
    Target("table", _table, _import),
    *(Target(name, make, _import) for name, make in SEQUENCES.items()),
    Target("captured motion", _captured, _open),
    Target("state", _state, _restore),
)
