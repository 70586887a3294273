from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from odeform.errors import InputError
from odeform.geometry.reading import read_geometry
from odeform.types import GaussianSplats, Mesh, PointCloud

SPHERE = trimesh.creation.icosphere(2, 0.3)
MESHES = ("obj", "ply", "stl", "glb", "off")
SPLAT = np.dtype([("xyz", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("rot", "u1", 4)])
INRIA = (
    *("x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "f_rest_0", "opacity"),
    *("scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"),
)


def inria(columns: dict[str, np.ndarray]) -> bytes:
    rows = np.stack(list(columns.values()), axis=1).astype("<f4")
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}"]
    header += [*(f"property float {name}" for name in columns), "end_header", ""]
    return "\n".join(header).encode() + rows.tobytes()


def inria_columns(count: int = 6) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(0)
    return {name: rng.normal(size=count) for name in INRIA}


def splats(count: int = 5) -> np.ndarray:
    rng = np.random.default_rng(1)
    raw = np.zeros(count, SPLAT)
    raw["xyz"], raw["scale"] = rng.normal(size=(count, 3)), rng.uniform(0.01, 0.1, (count, 3))
    raw["rgba"], raw["rot"] = rng.integers(0, 256, (count, 4)), rng.integers(0, 256, (count, 4))
    return raw


@pytest.mark.parametrize("ending", MESHES)
def test_meshes(tmp_path: Path, ending: str) -> None:
    SPHERE.export(tmp_path / f"ball.{ending}")
    mesh = read_geometry(tmp_path / f"ball.{ending}")
    assert isinstance(mesh, Mesh)
    assert mesh.points.shape == SPHERE.vertices.shape
    # formats may reorder vertices and faces, but not what they describe: the triangles with their orientation
    read = mesh.points[mesh.faces].reshape(-1, 9)
    true = SPHERE.triangles.reshape(-1, 9)
    turns = [np.roll(read, 3 * k, axis=1) for k in range(3)]
    distance = np.min([np.abs(true[:, None] - t[None]).max(axis=-1) for t in turns], axis=0)
    assert distance.min(axis=1).max() < 1e-6
    assert distance.min(axis=0).max() < 1e-6


def test_upper_case_ending(tmp_path: Path) -> None:
    SPHERE.export(tmp_path / "ball.stl")
    (tmp_path / "ball.stl").rename(tmp_path / "BALL.STL")
    assert isinstance(read_geometry(tmp_path / "BALL.STL"), Mesh)


def test_several_meshes_in_one_scene(tmp_path: Path) -> None:
    far = SPHERE.copy()
    far.apply_translation([2.0, 0.0, 0.0])
    trimesh.Scene([SPHERE, far]).export(tmp_path / "two.glb")
    mesh = read_geometry(tmp_path / "two.glb")
    assert len(mesh.points) == 2 * len(SPHERE.vertices)
    assert np.ptp(mesh.points, axis=0).max() == pytest.approx(2.6, abs=1e-5)


def test_quads(tmp_path: Path) -> None:
    (tmp_path / "quad.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
    mesh = read_geometry(tmp_path / "quad.obj")
    assert isinstance(mesh, Mesh)
    assert mesh.faces.shape == (2, 3)


def test_points(tmp_path: Path) -> None:
    points = np.random.default_rng(0).normal(size=(20, 3))
    trimesh.PointCloud(points).export(tmp_path / "points.ply")
    np.savetxt(tmp_path / "points.xyz", points)
    np.savetxt(tmp_path / "colored.xyz", np.concatenate([points, points], axis=1))
    for name in ("points.ply", "points.xyz", "colored.xyz"):
        cloud = read_geometry(tmp_path / name)
        assert isinstance(cloud, PointCloud)
        assert np.allclose(cloud.points, points, atol=1e-6)


def test_inria_splats(tmp_path: Path) -> None:
    columns = inria_columns()
    (tmp_path / "splats.ply").write_bytes(inria(columns))
    read = read_geometry(tmp_path / "splats.ply")
    assert isinstance(read, GaussianSplats)

    def stack(*names: str) -> np.ndarray:
        return np.stack([columns[name] for name in names], axis=1)

    assert np.allclose(read.points, stack("x", "y", "z"), atol=1e-6)
    color = 0.5 + stack("f_dc_0", "f_dc_1", "f_dc_2") / np.sqrt(4.0 * np.pi)
    assert np.allclose(read.colors, np.clip(color, 0.0, 1.0), atol=1e-6)
    assert np.allclose(read.opacities, 1.0 / (1.0 + np.exp(-columns["opacity"])), atol=1e-6)
    rotation = Rotation.from_quat(stack("rot_0", "rot_1", "rot_2", "rot_3"), scalar_first=True).as_matrix()
    variance = np.exp(stack("scale_0", "scale_1", "scale_2")) ** 2
    true = np.einsum("nij,nj,nkj->nik", rotation, variance, rotation)
    assert np.allclose(read.covariances, true, rtol=1e-5, atol=1e-5)


def test_splat_file(tmp_path: Path) -> None:
    raw = splats()
    (tmp_path / "a.splat").write_bytes(raw.tobytes())
    read = read_geometry(tmp_path / "a.splat")
    assert isinstance(read, GaussianSplats)
    assert np.array_equal(read.points, raw["xyz"])
    assert np.allclose(read.colors, raw["rgba"][:, :3] / 255.0)
    assert np.allclose(read.opacities, raw["rgba"][:, 3] / 255.0)
    rotation = Rotation.from_quat(raw["rot"].astype(float) - 128.0, scalar_first=True).as_matrix()
    true = np.einsum("nij,nj,nkj->nik", rotation, raw["scale"].astype(float) ** 2, rotation)
    assert np.allclose(read.covariances, true, atol=1e-9)


def damaged() -> dict[str, tuple[str, bytes]]:
    """Name of the damage -> ending and content of a file that has to be refused."""
    files: dict[str, tuple[str, bytes]] = {
        "mesh, no faces": ("off", b"OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n"),
        "mesh, no facets": ("stl", b"solid x\nendsolid x\n"),
        "mesh, face beyond the vertices": ("obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"),
        "mesh, all in one place": ("obj", b"v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n"),
        "points, one": ("xyz", b"0 0 0\n"),
        "points, all in one place": ("xyz", b"1 2 3\n1 2 3\n"),
        "points, not finite": ("xyz", b"0 0 0\nnan 0 0\n1 1 1\n"),
        "points, infinite": ("xyz", b"0 0 0\ninf 0 0\n1 1 1\n"),
        "points, plane": ("xyz", b"0 0\n1 1\n2 3\n"),
        "points, words": ("xyz", b"x y z\n0 0 0\n1 1 1\n"),
        "points, empty": ("xyz", b""),
        "splats, truncated": ("splat", splats().tobytes()[:-7]),
        "splats, empty": ("splat", b""),
        "splats, one": ("splat", splats(1).tobytes()),
        "inria, truncated": ("ply", inria(inria_columns())[:-30]),
        "inria, one": ("ply", inria(inria_columns(1))),
        "inria, no rotation": ("ply", inria({k: v for k, v in inria_columns().items() if k != "rot_2"})),
        "inria, half a color": ("ply", inria({k: v for k, v in inria_columns().items() if k != "f_dc_1"})),
        "compressed splats": ("ply", b"ply\nformat ascii 1.0\nproperty uint packed_position\nend_header\n"),
        "unknown ending": ("step", b"ISO-10303-21;"),
        "no ending": ("", b"v 0 0 0\n"),
    }
    points = SPHERE.vertices.copy()
    points[3] = np.nan
    broken = trimesh.Trimesh(points, SPHERE.faces, process=False)
    for ending in MESHES:
        whole = SPHERE.export(file_type=ending)
        whole = whole.encode() if isinstance(whole, str) else whole
        files[f"{ending}, truncated"] = (ending, whole[: len(whole) // 2])
        files[f"{ending}, not one"] = (ending, b"hello world\n" * 9)
        nan = broken.export(file_type=ending)
        files[f"{ending}, not finite"] = (ending, nan.encode() if isinstance(nan, str) else nan)
    for column in ("x", "opacity", "scale_1", "rot_0", "f_dc_0"):
        columns = inria_columns()
        columns[column][2] = np.nan
        files[f"inria, {column} not finite"] = ("ply", inria(columns))
    raw = splats()
    raw["scale"][2] = np.nan
    files["splats, scale not finite"] = ("splat", raw.tobytes())
    return files


DAMAGED = damaged()


@pytest.mark.filterwarnings("ignore::RuntimeWarning", "ignore::UserWarning")
@pytest.mark.parametrize("damage", DAMAGED)
def test_refuses(tmp_path: Path, damage: str) -> None:
    ending, content = DAMAGED[damage]
    path = tmp_path / f"shape.{ending}".rstrip(".")
    path.write_bytes(content)
    with pytest.raises(InputError, match=path.name):
        read_geometry(path)


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_geometry(tmp_path / "nothing.obj")
    with pytest.raises(InputError, match="no such file"):
        read_geometry(tmp_path)
