"""Damaged motions as `odeform import` reads them: one `(folder, random) -> path` for each kind of source."""

import io
import json
import zipfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import c3d
import numpy as np
import trimesh

from .mutations import Random, mutated, mutated_json
from .vtk_files import legacy, polydata, unstructured

__all__ = ["SEQUENCES"]

CORNERS = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
FRAMES = np.stack([CORNERS + np.array([0.0, 0.0, 0.1 * k]) for k in range(4)])
OBJ = ("\n".join(f"v {x} {y} {z}" for x, y, z in CORNERS) + "\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n").encode()
TABLE = b"sequence,mass (kg),split,rate\na,1,train,20\nb,2,test,20\n"
TABLES = (
    TABLE,
    b"sep=;\r\n" + TABLE.replace(b",", b";").replace(b"1;t", b"1,5;t"),
    b"# made by hand\n" + TABLE.replace(b",", b"\t"),
    TABLE.decode().encode("utf-16"),
    ",sequence,Stärke\n0,a,1\n1,b,2\n".encode("cp1252"),
    b'"sequence","mass [kg]" ,"rate (Hz)",\n"a","1",20,\n,,,\n"b","2",20,\n',
)
NAMES = ("f_{}.obj", "f_{:03}.obj", "f-{}.obj", "f_-{}.obj", "m_0.{}.obj", "m_{}e-3.obj", "f_{} (1).obj", "a1.{}_2.obj")
WORDS = ("1", "-1", "0.5", "1e-3", "1e999", "007", ".5", "1,5", "copy", "", "9" * 60, "\u0661", "1.10", "--2")


def _root(folder: Path, table: bytes = TABLE) -> Path:
    root = folder / "motions"
    root.mkdir()
    (root / "parameters.csv").write_bytes(table)
    return root


def _text(folder: Path, random: Random) -> Path:
    """A damaged table of any habit."""
    root = _root(folder, mutated(TABLES[random.integers(len(TABLES))], random))
    for name in ("a", "b"):
        (root / name).mkdir()
        for frame in range(2):
            (root / name / f"{frame}.obj").write_bytes(OBJ)
    return root


def _names(folder: Path, random: Random) -> Path:
    """Frames of odd names, and sometimes a damaged table of times."""
    root = _root(folder)
    pattern = NAMES[random.integers(len(NAMES))]
    names = [pattern.format(number) for number in range(4)]
    for _ in range(random.integers(0, 4)):
        index, word = int(random.integers(len(names))), WORDS[random.integers(len(WORDS))]
        names[index] = names[index].replace(str(index), word) if random.random() < 0.5 else f"{word}{names[index]}"
    for name in ("a", "b"):
        (root / name).mkdir()
        for frame in names:
            (root / name / frame).write_bytes(OBJ)
        if random.random() < 0.3:
            times = "file,time (ms)\n" + "".join(f'"{frame}",{50 * k}\n' for k, frame in enumerate(names))
            (root / name / "times.csv").write_bytes(mutated(times.encode(), random))
    return root


@cache
def _arrays() -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, t=0.05 * np.arange(4), positions=FRAMES, faces=FACES)
    return buffer.getvalue()


@cache
def _capture() -> bytes:
    writer = c3d.Writer(point_rate=100, analog_rate=0)
    for frame in 1000.0 * FRAMES:
        writer.add_frames([(np.column_stack([frame, np.zeros((4, 2))]), np.zeros((0, 1)))])
    writer.set_point_labels(["a", "b", "c", "d"])
    writer.get("POINT").set_str("UNITS", "", "mm", 2)
    file = io.BytesIO()
    writer.write(file)
    return file.getvalue()


@cache
def _fields() -> bytes:
    return legacy(CORNERS, FACES, {f"displacement{k}": 0.1 * k * CORNERS for k in range(3)}, binary=True)


def _one_file(ending: str, content: Callable[[], bytes]) -> Callable[[Path, Random], Path]:
    def make(folder: Path, random: Random) -> Path:
        root = _root(folder)
        (root / f"a.{ending}").write_bytes(mutated(content(), random))
        (root / f"b.{ending}").write_bytes(content())
        return root

    return make


def _listed(folder: Path, random: Random) -> Path:
    """A list of frames and one frame, both damaged at times."""
    root = _root(folder)
    entries = "".join(f'<DataSet timestep="{0.05 * k}" part="0" file="f{k}.vtu"/>' for k in range(4))
    text = f'<?xml version="1.0"?><VTKFile type="Collection"><Collection>{entries}</Collection></VTKFile>'.encode()
    forms = ("ascii", "binary", "zlib", "raw")
    form = forms[random.integers(len(forms))]
    for k, frame in enumerate(FRAMES):
        data = unstructured(frame, [[0, 1, 2, 3]], 10, {"u": frame}, form)
        (root / f"f{k}.vtu").write_bytes(mutated(data, random) if k == 1 and random.random() < 0.7 else data)
    (root / "a.pvd").write_bytes(mutated(text, random) if random.random() < 0.5 else text)
    (root / "b.pvd").write_bytes(text)
    return root


def _vtk_frames(folder: Path, random: Random) -> Path:
    """Frames of VTK, one of them damaged."""
    root = _root(folder)
    write = (
        ("vtk", lambda frame: legacy(frame, FACES)),
        ("vtk", lambda frame: legacy(CORNERS, FACES, {"disp": frame}, binary=True)),
        ("vtp", lambda frame: polydata(frame, FACES, "zlib")),
    )
    ending, data = write[random.integers(len(write))]
    for name in ("a", "b"):
        (root / name).mkdir()
        for k, frame in enumerate(FRAMES):
            (root / name / f"{k}.{ending}").write_bytes(data(frame))
    file = root / "a" / f"{random.integers(4)}.{ending}"
    file.write_bytes(mutated(file.read_bytes(), random))
    return root


def _stl_frames(folder: Path, random: Random) -> Path:
    """Frames of triangles, one of them damaged."""
    root = _root(folder)
    kind = ("stl", "stl_ascii")[random.integers(2)]
    for name in ("a", "b"):
        (root / name).mkdir()
        for k, frame in enumerate(FRAMES):
            data = trimesh.Trimesh(frame, FACES, process=False).export(file_type=kind)
            (root / name / f"{k}.stl").write_bytes(data if isinstance(data, bytes) else str(data).encode())
    file = root / "a" / f"{random.integers(4)}.stl"
    file.write_bytes(mutated(file.read_bytes(), random))
    return root


def _series(folder: Path, random: Random) -> Path:
    """A damaged list of frames in JSON."""
    root = _root(folder)
    for k, frame in enumerate(FRAMES):
        (root / f"f{k}.vtk").write_bytes(legacy(frame, FACES))
    content = {"file-series-version": "1.0", "files": [{"name": f"f{k}.vtk", "time": 0.05 * k} for k in range(4)]}
    text = json.dumps(content).encode()
    (root / "a.vtk.series").write_bytes(
        mutated_json(content, random) if random.random() < 0.5 else mutated(text, random)
    )
    (root / "b.vtk.series").write_bytes(text)
    return root


def _archive(folder: Path, random: Random) -> Path:
    """A damaged archive, or a sound one with an odd path or a damaged table."""
    path = folder / "motions.zip"
    odd = ("../x.obj", "/x.obj", "a\\..\\..\\x", "a/0.obj", "x" * 300, "x\u0000y", "C:x", "a")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("motions/parameters.csv", mutated(TABLE, random) if random.random() < 0.3 else TABLE)
        for name in ("a", "b"):
            for frame in range(2):
                archive.writestr(f"motions/{name}/{frame}.obj", OBJ)
        if random.random() < 0.3:
            archive.writestr(odd[random.integers(len(odd))], OBJ)
    if random.random() < 0.7:
        path.write_bytes(mutated(path.read_bytes(), random))
    return path


SEQUENCES: dict[str, Callable[[Path, Random], Path]] = {
    "sequence table": _text,
    "sequence names": _names,
    "sequence arrays": _one_file("npz", _arrays),
    "sequence capture": _one_file("c3d", _capture),
    "sequence fields": _one_file("vtk", _fields),
    "sequence list": _listed,
    "sequence frames of VTK": _vtk_frames,
    "sequence frames of STL": _stl_frames,
    "sequence series": _series,
    "sequence archive": _archive,
}
