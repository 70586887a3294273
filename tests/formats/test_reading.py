from pathlib import Path

import numpy as np
import pytest
import trimesh

from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.types import Mesh, PointCloud

SPHERE = trimesh.creation.icosphere(2, 0.3)
MESHES = ("obj", "ply", "stl", "glb", "off")


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
        "points, words": ("xyz", b"hello you there\n0 0 0\n1 1 1\n"),
        "points, empty": ("xyz", b""),
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
