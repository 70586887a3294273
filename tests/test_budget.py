"""A file gets no more memory than the budget, whatever it claims to hold."""

import gzip
import json
import struct
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh

from odeform.budget import read_limited, require_memory
from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.models.authors.file import PARTS, read_authors_checkpoint


def test_the_budget_is_said_in_words(tmp_path: Path) -> None:
    require_memory("file", "2 rows", 2e9)
    with pytest.raises(InputError, match=r"^file: 9 rows take about 9 GB of memory to read; expected at most 2 GB$"):
        require_memory("file", "9 rows", 9e9)
    (tmp_path / "file").write_bytes(bytes(9))
    assert read_limited(tmp_path / "file", "file", 9) == bytes(9)
    with pytest.raises(InputError, match="at most 0 MiB"):
        read_limited(tmp_path / "file", "file", 8)


def test_splats_are_counted_before_they_are_unpacked(tmp_path: Path) -> None:
    count = 10_000_000
    header = struct.pack("<4sIIBBBB", b"NGSP", 3, count, 0, 12, 0, 0)
    (tmp_path / "many.spz").write_bytes(gzip.compress(header + bytes(20 * count), compresslevel=1))
    with pytest.raises(InputError, match=r"10,000,000 splats take about 2\.\d+ GB"):
        read_geometry(tmp_path / "many.spz")


def test_a_view_of_one_number_is_not_expanded(tmp_path: Path) -> None:
    state = {"weight": torch.zeros(1).expand(3_000_000_000)}
    torch.save(dict.fromkeys(PARTS.values(), state), tmp_path / "wide.pth")
    with pytest.raises(InputError, match="3,000,000,000 numbers"):
        read_authors_checkpoint(tmp_path / "wide.pth")


def test_a_device_is_not_read_to_its_end() -> None:
    with pytest.raises(InputError, match="at most 512 MiB"):
        read_authors_checkpoint("/dev/zero")


def _gltf(path: Path, **parts: object) -> None:
    tree = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], **parts}
    path.write_text(json.dumps(tree))


def test_a_gltf_without_data_allocates_nothing(tmp_path: Path) -> None:
    accessor = {"componentType": 5126, "count": 1_000_000_000, "type": "VEC3"}
    mesh = {"primitives": [{"attributes": {"POSITION": 0}}]}
    _gltf(tmp_path / "a.gltf", accessors=[accessor], meshes=[mesh], nodes=[{"mesh": 0}])
    with pytest.raises(InputError, match="1,000,000,000 elements of accessors"):
        read_geometry(tmp_path / "a.gltf")


@pytest.mark.parametrize("uri", ["../secret.bin", "/etc/passwd", "http://192.0.2.1/a.bin"])
def test_a_gltf_reads_nothing_outside_of_its_folder(tmp_path: Path, uri: str) -> None:
    _gltf(tmp_path / "a.gltf", buffers=[{"uri": uri, "byteLength": 9}], nodes=[{}])
    with pytest.raises(InputError, match="outside of its folder"):
        read_geometry(tmp_path / "a.gltf")


def test_thousands_of_instances_are_joined_quickly(tmp_path: Path) -> None:
    scene, box = trimesh.Scene(), trimesh.creation.box()
    scene.add_geometry(box, geom_name="box", node_name="0")
    for index in range(1, 2_000):
        matrix = trimesh.transformations.translation_matrix([2.0 * index, 0.0, 0.0])
        scene.graph.update(frame_to=str(index), frame_from="world", matrix=matrix, geometry="box")
    scene.export(tmp_path / "boxes.glb")
    mesh = read_geometry(tmp_path / "boxes.glb")
    assert mesh.points.shape == (16_000, 3)
    np.testing.assert_allclose(np.ptp(mesh.points, axis=0), [3999.0, 1.0, 1.0], rtol=1e-6)


@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
def test_vertices_merge_at_any_scale(tmp_path: Path, scale: float) -> None:
    sphere = trimesh.creation.icosphere(2, scale)
    sphere.export(tmp_path / "sphere.stl")  # three vertices for each triangle
    mesh = read_geometry(tmp_path / "sphere.stl")
    assert len(mesh.points) == len(sphere.vertices)
    np.testing.assert_allclose(np.ptp(mesh.points, axis=0), 2.0 * scale, rtol=0.05)
