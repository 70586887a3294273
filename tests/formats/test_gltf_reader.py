"""glTF as the format says it: what is read, what is left out with a note, what is refused by its name."""

import json
from pathlib import Path

import numpy as np
import pytest
from fuzz.gltf_files import COMPONENTS, POINTS, TETRAHEDRON, Gltf

from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.types import GaussianSplats, Mesh, PointCloud


def _mesh(path: Path) -> Mesh:
    mesh = read_geometry(path)
    assert isinstance(mesh, Mesh)
    return mesh


def _area(mesh: Mesh) -> float:
    a, b, c = np.asarray(mesh.points, float)[mesh.faces].swapaxes(0, 1)
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def test_a_plain_file_is_y_up(tmp_path: Path) -> None:
    mesh = _mesh(Gltf().glb(tmp_path / "a.glb"))
    assert mesh.up == "+y"
    assert mesh.notes == ()
    np.testing.assert_array_equal(mesh.points.max(axis=0), [1, 2, 1])
    assert mesh.faces.shape == (4, 3)


@pytest.mark.parametrize("base", [True, False])
def test_sparse_accessors(tmp_path: Path, base: bool) -> None:
    file = Gltf()
    accessor = file.tree["accessors"][0]
    places = np.array([2] if base else [1, 2, 3], np.uint16)
    values = np.array([[0, 5, 0]] if base else [[1, 0, 0], [0, 2, 0], [0, 0, 1]], np.float32)
    accessor["sparse"] = {
        "count": len(places),
        "indices": {"bufferView": file.view(places.tobytes()), "componentType": 5123},
        "values": {"bufferView": file.view(values.tobytes())},
    }
    if not base:
        del accessor["bufferView"]
    mesh = _mesh(file.glb(tmp_path / "a.glb"))
    assert len(mesh.points) == 4
    np.testing.assert_array_equal(mesh.points.max(axis=0), [1, 5 if base else 2, 1])


def test_a_sparse_accessor_beyond_its_elements_is_refused(tmp_path: Path) -> None:
    file = Gltf()
    file.tree["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": file.view(np.array([4], np.uint16).tobytes()), "componentType": 5123},
        "values": {"bufferView": file.view(bytes(12))},
    }
    with pytest.raises(InputError, match="a sparse accessor: expected whole numbers below 4"):
        read_geometry(file.glb(tmp_path / "a.glb"))


@pytest.mark.parametrize("of_node", [True, False])
def test_morph_targets_have_their_default_weights(tmp_path: Path, of_node: bool) -> None:
    file = Gltf()
    moved = np.zeros((4, 3), np.float32)
    moved[2, 1] = 3.0
    file.primitive["targets"] = [{"POSITION": file.add(moved)}]
    file.tree["meshes"][0]["weights"] = [0.0 if of_node else 1.0]
    if of_node:
        file.tree["nodes"][0]["weights"] = [1.0]
    assert _mesh(file.glb(tmp_path / "a.glb")).points[:, 1].max() == 5.0


@pytest.mark.parametrize("dtype", [np.int8, np.uint8, np.int16, np.uint16])
@pytest.mark.parametrize("normalized", [True, False])
def test_quantised_positions(tmp_path: Path, dtype: type, normalized: bool) -> None:
    """A normalised 32,767 is 1, and a node scales it to its size; an aligned stride of four numbers is common."""
    top = np.iinfo(dtype).max if normalized else 100
    padded = np.zeros((4, 4), dtype)
    padded[:, :3] = POINTS.astype(int) * (top // 2)
    file = Gltf()
    view = file.view(padded.tobytes())
    file.tree["bufferViews"][view]["byteStride"] = padded.strides[0]
    accessor = {"bufferView": view, "componentType": COMPONENTS[padded.dtype.name]}
    file.tree["accessors"][0] = {**accessor, "count": 4, "type": "VEC3", "normalized": normalized}
    file.tree["extensionsRequired"] = ["KHR_mesh_quantization"]
    file.tree["nodes"][0]["scale"] = [10, 10, 10]
    high = 10.0 * np.array([top // 2, 2 * (top // 2), top // 2]) / (top if normalized else 1)
    np.testing.assert_allclose(_mesh(file.glb(tmp_path / "a.glb")).points.max(axis=0), high, rtol=1e-6)


def test_instances_of_a_mesh_under_several_nodes(tmp_path: Path) -> None:
    file = Gltf()
    file.tree["nodes"] = [
        {"children": [1, 2], "translation": [0, 0, 10]},
        {"mesh": 0},
        {"mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 7, 0, 0, 1]},
    ]
    mesh = _mesh(file.glb(tmp_path / "a.glb"))
    assert len(mesh.points) == 8
    np.testing.assert_array_equal(mesh.points.min(axis=0), [0, 0, 10])
    np.testing.assert_array_equal(mesh.points.max(axis=0), [7, 2, 11])
    # the mirrored one is turned inside out again
    for part in (slice(0, 4), slice(4, 8)):
        faces = mesh.faces[part]
        a, b, c = (np.asarray(mesh.points, float) - mesh.points[faces.min()])[faces].swapaxes(0, 1)
        assert np.einsum("fi,fi->", a, np.cross(b, c)) == pytest.approx(2.0)


def test_gpu_instancing(tmp_path: Path) -> None:
    file = Gltf()
    shifts = np.array([[0, 0, 0], [10, 0, 0], [20, 0, 0]], np.float32)
    half = np.sqrt(0.5)
    turns = np.array([[0, 0, 0, 1], [0, 0, 0, 1], [0, 0, half, half]], np.float32)
    attributes = {"TRANSLATION": file.add(shifts), "ROTATION": file.add(turns)}
    file.tree["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    file.tree["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    mesh = _mesh(file.glb(tmp_path / "a.glb"))
    assert len(mesh.points) == 12
    np.testing.assert_allclose([mesh.points.min(axis=0), mesh.points.max(axis=0)], [[0, 0, 0], [20, 2, 1]], atol=1e-6)


def test_bones_move_a_skin_and_its_own_node_does_not(tmp_path: Path) -> None:
    file = Gltf()
    file.primitive["attributes"] |= {
        "JOINTS_0": file.add(np.array([[0, 0, 0, 0]] * 2 + [[1, 0, 0, 0]] * 2, np.uint8)),
        "WEIGHTS_0": file.add(np.array([[1, 0, 0, 0]] * 4, np.float32)),
    }
    inverse = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))
    inverse[1, 3, :3] = (0, -1, 0)  # by columns: bound at y 1
    file.tree["skins"] = [{"joints": [1, 2], "inverseBindMatrices": file.add(inverse)}]
    file.tree["nodes"] = [
        {"mesh": 0, "skin": 0, "translation": [99, 99, 99]},
        {"children": [2]},
        {"translation": [0, 4, 0]},
    ]
    file.tree["scenes"] = [{"nodes": [0, 1]}]
    mesh = _mesh(file.glb(tmp_path / "a.glb"))
    np.testing.assert_allclose(mesh.points, POINTS + np.array([[0, 0, 0], [0, 0, 0], [0, 3, 0], [0, 3, 0]]))


@pytest.mark.parametrize(("mode", "indices"), [(5, [0, 1, 2, 3]), (6, [0, 1, 3, 2]), (4, [0, 1, 2, 2, 1, 3])])
def test_strips_and_fans(tmp_path: Path, mode: int, indices: list[int]) -> None:
    square = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], np.float32)
    file = Gltf(square, np.array(indices, np.uint8))
    file.primitive["mode"] = mode
    mesh = _mesh(file.glb(tmp_path / "a.glb"))
    a, b, c = mesh.points[mesh.faces].swapaxes(0, 1)
    np.testing.assert_allclose(np.cross(b - a, c - a), [[0, 0, 1], [0, 0, 1]], atol=1e-7)


def test_points_with_colors_and_lines(tmp_path: Path) -> None:
    file = Gltf(indices=None)
    file.primitive |= {"mode": 0}
    file.primitive["attributes"]["COLOR_0"] = file.add(np.array([[255, 0, 0, 255]] * 4, np.uint8), normalized=True)
    file.tree["meshes"][0]["primitives"].append({**file.primitive, "mode": 1})
    cloud = read_geometry(file.glb(tmp_path / "a.glb"))
    assert isinstance(cloud, PointCloud)
    assert cloud.colors is not None
    np.testing.assert_array_equal(cloud.colors, [[255, 0, 0]] * 4)
    assert "1 part of lines left out" in cloud.notes
    file.tree["meshes"][0]["primitives"] = [{**file.primitive, "mode": 1}]
    with pytest.raises(InputError, match=r"expected a mesh in a scene, got none.*lines"):
        read_geometry(file.glb(tmp_path / "a.glb"))


@pytest.mark.parametrize(("uri", "name"), [("my%20data.bin", "my data.bin"), ("a%20b.bin", "a%20b.bin")])
def test_percent_encoded_uris(tmp_path: Path, uri: str, name: str) -> None:
    assert len(_mesh(Gltf().gltf(tmp_path / "a.gltf", uri, name)).points) == 4


def test_an_encoded_way_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    file = Gltf().gltf(tmp_path / "in" / "a.gltf", "%2e%2e/secret.bin", "x.bin")
    with pytest.raises(InputError, match="outside of its folder"):
        read_geometry(file)


@pytest.mark.parametrize("name", ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "ACME_unknown"])
def test_required_extensions_that_are_not_known_are_named(tmp_path: Path, name: str) -> None:
    file = Gltf()
    file.tree["extensionsRequired"] = file.tree["extensionsUsed"] = [name]
    with pytest.raises(InputError, match=f"extension {name}, which is not read"):
        read_geometry(file.glb(tmp_path / "a.glb"))


def test_compression_that_is_not_required_is_refused_where_it_holds_the_only_data(tmp_path: Path) -> None:
    draco = Gltf()
    draco.primitive["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}
    assert len(_mesh(draco.glb(tmp_path / "a.glb")).points) == 4  # a fallback
    del draco.tree["accessors"][0]["bufferView"]
    with pytest.raises(InputError, match="KHR_draco_mesh_compression"):
        read_geometry(draco.glb(tmp_path / "a.glb"))
    packed = Gltf()
    packed.tree["buffers"] = [{}, {"byteLength": 999, "extensions": {"EXT_meshopt_compression": {"fallback": True}}}]
    packed.tree["bufferViews"][0]["buffer"] = 1
    with pytest.raises(InputError, match="EXT_meshopt_compression"):
        read_geometry(packed.glb(tmp_path / "a.glb"))


SPLATS = "KHR_gaussian_splatting"


def _splats() -> Gltf:
    file = Gltf(indices=None)
    file.primitive |= {"mode": 0, "extensions": {SPLATS: {"kernel": "ellipse", "colorSpace": "srgb_rec709_display"}}}
    file.primitive["attributes"] |= {
        f"{SPLATS}:ROTATION": file.add(np.array([[0, 0, 0, 1]] * 4, np.float32)),
        f"{SPLATS}:SCALE": file.add(np.array([[0.1, 0.2, 0.3]] * 4, np.float32)),
        f"{SPLATS}:OPACITY": file.add(np.full(4, 0.7, np.float32)),
        f"{SPLATS}:SH_DEGREE_0_COEF_0": file.add(np.full((4, 3), 0.5, np.float32)),
    }
    return file


def test_gaussian_splats(tmp_path: Path) -> None:
    file = _splats()
    half = float(np.sqrt(0.5))
    file.tree["nodes"][0] |= {"rotation": [0, 0, half, half], "scale": [2, 2, 2]}  # x to y
    splats = read_geometry(file.glb(tmp_path / "a.glb"))
    assert isinstance(splats, GaussianSplats)
    assert splats.up == "+y"
    np.testing.assert_allclose(splats.covariances[0], np.diag([0.16, 0.04, 0.36]), atol=1e-6)
    np.testing.assert_allclose(splats.points.min(axis=0), [-4, 0, 0], atol=1e-6)
    np.testing.assert_allclose(splats.opacities, 0.7, atol=1e-6)
    np.testing.assert_allclose(splats.harmonics, 0.5)


def test_splats_without_their_properties_or_compressed_are_refused(tmp_path: Path) -> None:
    file = _splats()
    for name in ("ROTATION", "SCALE", "OPACITY"):
        del file.primitive["attributes"][f"{SPLATS}:{name}"]
    with pytest.raises(InputError, match=f"splats of {SPLATS} without ROTATION, SCALE, OPACITY"):
        read_geometry(file.glb(tmp_path / "a.glb"))
    file.primitive["extensions"][SPLATS]["extensions"] = {"KHR_gaussian_splatting_compression_spz_2": {}}
    with pytest.raises(InputError, match="compression_spz_2, which is not read"):
        read_geometry(file.glb(tmp_path / "a.glb"))


def test_the_default_scene_and_what_is_left_out(tmp_path: Path) -> None:
    file = Gltf()
    file.tree |= {"scenes": [{"nodes": []}, {"nodes": [0]}], "scene": 1, "animations": [{}]}
    mesh = _mesh(file.glb(tmp_path / "a.glb"))
    assert [note.split(":")[0] for note in mesh.notes] == ["1 of 2 scenes left out", "animation left out"]


DAMAGE = {
    "cut": (lambda data: data[:-20], "truncated"),
    "of version 1": (lambda data: data[:4] + b"\1\0\0\0" + data[8:], "binary glTF 2, got version 1"),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_damage_is_named(tmp_path: Path, damage: str) -> None:
    change, said = DAMAGE[damage]
    path = Gltf().glb(tmp_path / "a.glb")
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(InputError, match=said):
        read_geometry(path)


def test_indices_beyond_the_vertices_and_odd_corners(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="refers to vertex 9, of 4"):
        read_geometry(Gltf(indices=np.array([0, 1, 9], np.uint16)).glb(tmp_path / "a.glb"))
    with pytest.raises(InputError, match="three corners for each triangle, got 11"):
        read_geometry(Gltf(indices=TETRAHEDRON[:-1]).glb(tmp_path / "a.glb"))


def test_what_is_missing_in_the_json_is_named(tmp_path: Path) -> None:
    narrow = Gltf()
    narrow.tree["bufferViews"][0]["byteStride"] = 8
    with pytest.raises(InputError, match="expected a byteStride of at least 12 bytes an element, got 8"):
        read_geometry(narrow.glb(tmp_path / "a.glb"))
    path = Gltf().gltf(tmp_path / "a.gltf", "a.bin", "a.bin")
    path.write_text(path.read_text().replace(', "uri": "a.bin"', ""))
    with pytest.raises(InputError, match="buffer 0: expected a URI, got none"):
        read_geometry(path)


def test_a_node_below_itself(tmp_path: Path) -> None:
    file = Gltf()
    file.tree["nodes"][0]["children"] = [0]
    with pytest.raises(InputError, match="node 0 has two parents, or is below itself"):
        read_geometry(file.glb(tmp_path / "a.glb"))


def test_another_file_is_no_gltf(tmp_path: Path) -> None:
    (tmp_path / "a.glb").write_bytes(b"Kaydara FBX Binary")
    with pytest.raises(InputError, match="expected glTF, binary or as JSON, got b'Kaydara FBX '"):
        read_geometry(tmp_path / "a.glb")


def test_json_with_a_byte_order_mark(tmp_path: Path) -> None:
    path = Gltf().gltf(tmp_path / "a.gltf", "a.bin", "a.bin")
    path.write_bytes(b"\xef\xbb\xbf" + json.dumps(json.loads(path.read_text())).encode())
    assert _area(_mesh(path)) > 0.0
