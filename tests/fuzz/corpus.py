"""Small valid files of every format, made by the project's own code: nothing of it is stored."""

import gzip
import io
import json
import struct
import tempfile
from base64 import b64encode
from pathlib import Path

import numpy as np
import trimesh
import zstandard
from PIL import Image

from odeform.dataset.folder import folder_reader, save_sequence, write_index
from odeform.dataset.index import Dataset, Entry
from odeform.dataset.packed import pack
from odeform.formats.splat_inria import inria_bytes
from odeform.formats.splat_spz import spz_bytes
from odeform.simulation.scenes.registry import get_scene
from odeform.types import GaussianSplats, MotionSequence

from .gltf_files import Gltf
from .scans import CUBE, ksplat_bytes, las_bytes, msh_bytes, pcd_bytes, sog_bytes, vtk_bytes, vtu_bytes
from .vtk_files import legacy, polydata, unstructured

__all__ = ["dataset", "shapes"]

SPLATS = "KHR_gaussian_splatting"


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
    files |= {
        f"{form}.vtp": polydata(mesh.vertices, faces, form) for form in ("ascii", "binary", "zlib", "lzma", "raw")
    }
    files["cells.vtu"] = unstructured(mesh.vertices, faces, 5, form="raw")
    text = io.StringIO()
    np.savetxt(text, mesh.vertices)
    files |= dict.fromkeys(("points.xyz", "points.txt", "points.asc"), text.getvalue().encode())
    files["big_endian.ply"] = _big_endian(mesh)
    for degree in (0, 3):
        files[f"splats_{degree}.ply"] = inria_bytes(_splats(degree))
    files["splats.splat"] = _antimatter(20)
    files["v3.spz"] = spz_bytes(_splats(0))
    body = gzip.decompress(files["v3.spz"])
    files["plain.spz"] = body
    files["v4.spz"] = _version_4(body)
    files["compressed.ply"] = _compressed(20)
    return {**files, **_scenes(mesh), **_scans(mesh.vertices)}


def _scenes(mesh: trimesh.Trimesh) -> dict[str, bytes]:
    """Meshes of more than triangles: what the formats know beside them."""
    cells, kinds = [list(range(8)), [0, 1, 2, 8]], [12, 10]
    points = np.concatenate([CUBE, [[0.5, 0.5, -1.0]]])
    ring = "".join(f"v {x} {y} 0 1 0 0\n" for x, y in ((0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)))
    uv = "vt 0 0\nvt 1 0\nvt 1 1\n"
    strip = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    strip += "element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 1\n"
    coff = "COFF\n4 2 0\n" + "".join(f"{x} {y} 0 255 0 0 255\n" for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
    files = {
        "polygons.obj": f"mtllib a.mtl\n{ring}{uv}usemtl a\nf -8 -7 -6 -5 -4 -3 -2 -1\nf 1/1 2/2 3/3\nf 1 2/1 3//1\n",
        "strip.ply": f"{strip}7 0 1 2 3 -1 0 1\n",
        "colors.off": f"{coff}3 0 1 2 0.5 0.5 0.5\n4 0 1 2 3\n",
    }
    out = {name: text.encode() for name, text in files.items()}
    for binary in (False, True):
        out[f"cells_{binary}.vtk"] = vtk_bytes(points, cells, kinds, binary)
        for version in ("2.2", "4.1"):
            tetrahedra = [[0, 1, 2, 4], [1, 2, 4, 6]]
            out[f"cells_{version[0]}_{binary}.msh"] = msh_bytes(CUBE, tetrahedra, version, binary)
    for form in ("ascii", "binary", "zlib", "appended"):
        out[f"cells_{form}.vtu"] = vtu_bytes(points, cells, kinds, form)
    scenes = {"full.glb": _full(), "splats.glb": _gltf_splats(), **_compressed_gltf()}
    with tempfile.TemporaryDirectory() as folder:
        for name, file in scenes.items():
            out[name] = file.glb(Path(folder) / name).read_bytes()
    full = _full()
    full.tree["buffers"] = [{"byteLength": len(full.data), "uri": f"data:;base64,{b64encode(full.data).decode()}"}]
    out["full.gltf"] = json.dumps(full.tree).encode()
    return out


def _gltf_splats() -> Gltf:
    splats = _splats(1)
    points = np.asarray(splats.points)
    file, count = Gltf(points, indices=None), len(points)
    properties = {
        "ROTATION": np.tile(np.eye(4)[3], (count, 1)),
        "SCALE": np.full((count, 3), 0.1),
        "OPACITY": np.ones(count),
    }
    properties |= {f"SH_DEGREE_{int(n > 0)}_COEF_{max(n - 1, 0)}": np.asarray(splats.harmonics)[:, n] for n in range(4)}
    attributes = {f"{SPLATS}:{name}": file.add(values.astype(np.float32)) for name, values in properties.items()}
    file.primitive["attributes"] |= attributes
    file.primitive |= {"mode": 0, "extensions": {SPLATS: {"kernel": "ellipse"}}}
    return file


def _compressed_gltf() -> dict[str, Gltf]:
    """Files that say a known compression, once as required, and once beside numbers that are not there."""
    draco, meshopt, required = Gltf(), Gltf(), Gltf()
    draco.primitive["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}
    del draco.tree["accessors"][0]["bufferView"]
    meshopt.tree["buffers"] = [{}, {"byteLength": 999, "extensions": {"EXT_meshopt_compression": {"fallback": True}}}]
    meshopt.tree["bufferViews"][0]["buffer"] = 1
    required.tree["extensionsRequired"] = ["EXT_meshopt_compression"]
    return {"draco.glb": draco, "meshopt.glb": meshopt, "required.glb": required}


def _full() -> Gltf:
    """Morph targets, bones, instances, colors, a texture, and a sparse accessor in one file."""
    file = Gltf()
    image = io.BytesIO()
    Image.new("RGB", (4, 4), (255, 0, 0)).save(image, "png")
    file.primitive["attributes"] |= {
        "JOINTS_0": file.add(np.zeros((4, 4), np.uint8)),
        "WEIGHTS_0": file.add(np.array([[1, 0, 0, 0]] * 4, np.float32)),
        "COLOR_0": file.add(np.full((4, 4), 200, np.uint8), normalized=True),
        "TEXCOORD_0": file.add(np.full((4, 2), 0.3, np.float32)),
    }
    sparse = {
        "count": 1,
        "indices": {"bufferView": file.view(b"\2\0\0\0"), "componentType": 5123},
        "values": {"bufferView": file.view(np.ones(3, np.float32).tobytes())},
    }
    file.primitive |= {"material": 0, "targets": [{"POSITION": file.add(np.ones((4, 3), np.float32), sparse=sparse)}]}
    shifts = {"TRANSLATION": file.add(np.eye(3, dtype=np.float32))}
    file.tree |= {
        "nodes": [
            {"mesh": 0, "skin": 0},
            {"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": shifts}}},
        ],
        "scenes": [{"nodes": [0, 1]}],
        "skins": [{"joints": [1]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"bufferView": file.view(image.getvalue())}],
    }
    file.tree["meshes"][0]["weights"] = [0.5]
    return file


def _scans(points: np.ndarray) -> dict[str, bytes]:
    """Points and splats of other programs."""
    colors = np.full((len(points), 3), 200, np.uint8)
    files = {f"points_{kind}.pcd": pcd_bytes(points, colors, kind) for kind in ("ascii", "binary", "binary_compressed")}
    rows = [f"{x:.4f};{y:.4f};{z:.4f};10;20;30" for x, y, z in points.tolist()]
    files["points.csv"] = "\n".join(["X;Y;Z;R;G;B", *rows, ""]).replace(".", ",").encode()
    rows = [f"{x} {y} {z} 5 10 20 30" for x, y, z in points.tolist()]
    files["points.pts"] = "\n".join([str(len(rows)), *rows, ""]).encode()
    for suffix in ("las", "laz"):
        files[f"points.{suffix}"] = las_bytes(points, colors, suffix == "laz")
    for level in range(3):
        files[f"level_{level}.ksplat"] = ksplat_bytes(points[:20], level, level)
    files["splats.sog"] = sog_bytes(points[:20], bands=1)
    return files


def _exported(shape: trimesh.Trimesh | trimesh.PointCloud, kind: str) -> bytes:
    data = shape.export(file_type=kind)
    return data if isinstance(data, bytes) else str(data).encode()


def _big_endian(mesh: trimesh.Trimesh) -> bytes:
    header = f"ply\nformat binary_big_endian 1.0\nelement vertex {len(mesh.vertices)}\n"
    header += "".join(f"property double {axis}\n" for axis in "xyz")
    header += f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = np.zeros(len(mesh.faces), [("count", "u1"), ("corners", ">i4", 3)])
    rows["count"], rows["corners"] = 3, mesh.faces
    return header.encode() + np.asarray(mesh.vertices, ">f8").tobytes() + rows.tobytes()


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
