"""Small valid files of every format, made by the project's own code: nothing of it is stored."""

import gzip
import io
import struct
from pathlib import Path

import numpy as np
import trimesh
import zstandard

from odeform.dataset.folder import folder_reader, save_sequence, write_index
from odeform.dataset.index import Dataset, Entry
from odeform.dataset.packed import pack
from odeform.formats.splat_inria import inria_bytes
from odeform.formats.splat_spz import spz_bytes
from odeform.simulation.scenes.registry import get_scene
from odeform.types import GaussianSplats, MotionSequence

from .vtk_files import legacy, polydata, unstructured

__all__ = ["dataset", "shapes"]


def shapes() -> dict[str, bytes]:
    """File name -> content, at least one for every reader of shapes."""
    mesh = trimesh.creation.icosphere(1)
    files = {f"mesh.{kind}": _exported(mesh, kind) for kind in ("obj", "off", "stl", "ply", "glb")}
    files["ascii.stl"] = _exported(mesh, "stl_ascii")
    files["ascii.ply"] = mesh.export(file_type="ply", encoding="ascii")
    files["scene.glb"] = trimesh.Scene([mesh, mesh.copy().apply_translation([3.0, 0.0, 0.0])]).export(file_type="glb")
    files["points.ply"] = _exported(trimesh.PointCloud(mesh.vertices), "ply")
    faces = np.asarray(mesh.faces)
    files["text.vtk"] = legacy(mesh.vertices, faces)
    files["binary.vtk"] = legacy(mesh.vertices, faces, {"v": mesh.vertices}, binary=True)
    files |= {f"{form}.vtp": polydata(mesh.vertices, faces, form) for form in ("ascii", "binary", "zlib", "raw")}
    files["cells.vtu"] = unstructured(mesh.vertices, faces, 5, form="raw")
    text = io.StringIO()
    np.savetxt(text, mesh.vertices)
    files["points.xyz"] = text.getvalue().encode()
    for degree in (0, 3):
        files[f"splats_{degree}.ply"] = inria_bytes(_splats(degree))
    files["splats.splat"] = _antimatter(20)
    files["v3.spz"] = spz_bytes(_splats(0))
    body = gzip.decompress(files["v3.spz"])
    files["plain.spz"] = body
    files["v4.spz"] = _version_4(body)
    files["compressed.ply"] = _compressed(20)
    return files


def _exported(shape: trimesh.Trimesh | trimesh.PointCloud, kind: str) -> bytes:
    data = shape.export(file_type=kind)
    return data if isinstance(data, bytes) else str(data).encode()


def _splats(degree: int, count: int = 20) -> GaussianSplats:
    random = np.random.default_rng(degree)
    covariances = np.tile(1e-4 * np.eye(3), (count, 1, 1))
    return GaussianSplats(
        random.normal(size=(count, 3)).astype(np.float32),
        covariances,
        random.normal(size=(count, (degree + 1) ** 2, 3)).astype(np.float32),
        np.full(count, 0.5),
    )


def _antimatter(count: int) -> bytes:
    random = np.random.default_rng(0)
    rows = [
        struct.pack("<6f", *random.normal(size=3), 0.1, 0.1, 0.1) + bytes(random.integers(1, 256, 8, dtype=np.uint8))
        for _ in range(count)
    ]
    return b"".join(rows)


def _version_4(body: bytes) -> bytes:
    """Version 4 of the same splats, of degree 0: a stream for each attribute behind a table."""
    magic, _, count, *rest = struct.unpack_from("<4sIIBBBB", body)
    parts, start = [], 16
    for width in (9, 1, 3, 3, 4):
        parts.append(zstandard.compress(body[start : start + count * width]))
        start += count * width
    sizes = zip(parts, (9, 1, 3, 3, 4), strict=True)
    table = b"".join(struct.pack("<QQ", len(part), count * width) for part, width in sizes)
    header = struct.pack("<4sIIBBBB", magic, 4, count, *rest[:3], len(parts)) + struct.pack("<I", 32)
    return header.ljust(32, b"\0") + table + b"".join(parts)


def _compressed(count: int) -> bytes:
    names = [f"{end}_{name}" for name in ("x", "y", "z", "scale_x", "scale_y", "scale_z") for end in ("min", "max")]
    packed = ["packed_position", "packed_rotation", "packed_scale", "packed_color"]
    header = ["ply", "format binary_little_endian 1.0", "element chunk 1", *(f"property float {n}" for n in names)]
    header += [f"element vertex {count}", *(f"property uint {name}" for name in packed), "end_header", ""]
    words = np.random.default_rng(0).integers(0, 2**32, 4 * count, dtype=np.uint32)
    return "\n".join(header).encode() + struct.pack("<12f", *(-1.0, 1.0) * 3, *(-6.0, -3.0) * 3) + words.tobytes()


def dataset(folder: Path) -> Dataset:
    """A data set of three short sequences in `folder`, and the same packed in `folder`.odp."""
    points = np.random.default_rng(0).normal(size=(6, 3))
    faces = np.array([[0, 1, 2], [2, 3, 4], [3, 4, 5]], dtype=np.int32)
    schema, entries = get_scene("kick").schema, []
    for number, split in enumerate(("train", "val", "test")):
        frames = (points + 0.01 * np.random.default_rng(number).normal(size=(4, 6, 3))).astype(np.float32)
        sequence = MotionSequence(np.arange(4) / 20.0, frames, faces, np.full(6, 1.0 / 6.0))
        name = f"s{number}"
        entries.append(Entry(name, split, schema.complete({}), save_sequence(folder, name, sequence)))
    made = Dataset(folder, schema, tuple(entries), folder_reader(folder), {"radius_m": 0.1}, {"seed": 0})
    write_index(made)
    pack(made, folder.with_suffix(".odp"))
    return made
