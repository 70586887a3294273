"""Files that are something else than their names say, of formats that are not read, and far from the origin."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from odeform.errors import InputError
from odeform.formats.bundled import read_shape
from odeform.formats.foreign import UNREAD
from odeform.formats.reading import read_geometry
from odeform.formats.registry import READERS
from odeform.geometry.parts import split
from odeform.geometry.region import Sphere
from odeform.types import Mesh, PointCloud

CONTENTS = {
    "a pointer": (b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12345678\n", "pointer of Git LFS"),
    "a page": (b"\n<!DOCTYPE html>\n<html><body>404</body></html>", "got a page of HTML: download"),
    "nothing": (b"", "an empty file of no bytes"),
    "zeros": (bytes(600), "got a file that starts with 512 zeros or blanks"),
    "an archive": (b"Rar!\x1a\x07\x00" + bytes(99), "got a rar archive: unpack it first"),
}


@pytest.mark.parametrize("suffix", READERS)
@pytest.mark.parametrize("content", CONTENTS)
def test_what_a_file_is_instead(tmp_path: Path, suffix: str, content: str) -> None:
    data, said = CONTENTS[content]
    (tmp_path / f"a{suffix}").write_bytes(data)
    with pytest.raises(InputError, match=said) as caught:
        read_geometry(tmp_path / f"a{suffix}")
    assert f"a{suffix}: expected {suffix}" in str(caught.value)


@pytest.mark.parametrize("suffix", UNREAD)
def test_formats_that_are_not_read_say_what_to_convert_to(tmp_path: Path, suffix: str) -> None:
    (tmp_path / f"a{suffix}").write_bytes(b"anything")
    with pytest.raises(InputError, match=rf"{suffix} is not read: convert it to \.[a-z]+"):
        read_geometry(tmp_path / f"a{suffix}")
    assert suffix not in READERS


@pytest.mark.parametrize(
    ("suffix", "said"), [(".zip", "unpack it first"), (".gz", "unpack it first"), (".npz", "`odeform import` reads it")]
)
def test_archives_and_motions_say_what_to_do(tmp_path: Path, suffix: str, said: str) -> None:
    (tmp_path / f"a{suffix}").write_bytes(b"anything")
    with pytest.raises(InputError, match=f"{suffix} .*{said}"):
        read_geometry(tmp_path / f"a{suffix}")


AWAY = np.array([500_000.0, 5_400_000.0, 120.0])


def _capture(path: Path) -> np.ndarray:
    points = AWAY + np.random.default_rng(0).uniform(0.0, 3.0, (40, 3)).round(3)
    np.savetxt(path, points, "%.3f")
    return points


def test_captures_in_the_coordinates_of_a_map_keep_their_millimetres(tmp_path: Path) -> None:
    points = _capture(tmp_path / "a.xyz")
    cloud = read_geometry(tmp_path / "a.xyz")
    np.testing.assert_allclose(cloud.points.astype(float) + cloud.offset, points, atol=1e-6)
    assert cloud.points.dtype == np.float32
    x, y, z = cloud.offset
    assert cloud.notes == (
        f"positions are relative to ({x:.0f}, {y:.0f}, {z:.0f}) of the file, whose coordinates are too large",
    )


@pytest.mark.parametrize("suffix", ["obj", "ply", "off"])
def test_meshes_in_the_coordinates_of_a_map(tmp_path: Path, suffix: str) -> None:
    ball = trimesh.creation.icosphere(2, 0.5)
    ball.apply_translation(AWAY)
    text = {"obj": "v {} {} {}\n", "ply": "{} {} {}\n", "off": "{} {} {}\n"}[suffix]
    faces = {"obj": "f {} {} {}\n", "ply": "3 {} {} {}\n", "off": "3 {} {} {}\n"}[suffix]
    head = {"obj": "", "off": f"OFF\n{len(ball.vertices)} {len(ball.faces)} 0\n"}.get(
        suffix,
        f"ply\nformat ascii 1.0\nelement vertex {len(ball.vertices)}\nproperty double x\nproperty double y\n"
        f"property double z\nelement face {len(ball.faces)}\nproperty list uchar int vertex_indices\nend_header\n",
    )
    rows = "".join(text.format(*xyz) for xyz in ball.vertices.tolist())
    rows += "".join(faces.format(*face) for face in (ball.faces + (suffix == "obj")).tolist())
    (tmp_path / f"a.{suffix}").write_text(head + rows)
    mesh = read_geometry(tmp_path / f"a.{suffix}")
    assert isinstance(mesh, Mesh)
    assert len(mesh.points) == len(ball.vertices)
    made = trimesh.Trimesh(mesh.points, mesh.faces, process=False)
    assert made.volume == pytest.approx(ball.volume, rel=1e-5)
    # frames of a sequence have one origin, whatever they show
    frame = read_geometry(tmp_path / f"a.{suffix}", merge=False)
    assert frame.points.dtype == np.float64
    np.testing.assert_allclose(frame.points, ball.vertices, atol=1e-9)


def test_a_shape_that_single_precision_holds_stays_where_it_is(tmp_path: Path) -> None:
    points = np.random.default_rng(0).normal(size=(40, 3)) + 20.0
    np.savetxt(tmp_path / "a.xyz", points)
    cloud = read_geometry(tmp_path / "a.xyz")
    assert cloud.offset == (0.0, 0.0, 0.0)
    assert cloud.notes == ()
    np.testing.assert_array_equal(cloud.points, points.astype(np.float32))


def test_a_region_is_in_the_coordinates_of_the_file(tmp_path: Path) -> None:
    points = _capture(tmp_path / "a.xyz")
    centre = points[0].tolist()
    (tmp_path / "a.region.json").write_text(f'{{"sphere": {{"centre": {centre}, "radius": 1.0}}}}')
    shape, region = read_shape(tmp_path / "a.xyz")
    assert region is not None
    part, _ = split(shape, region)
    assert len(part.points) == (np.linalg.norm(points - points[0], axis=1) <= 1.0).sum()


def test_colors_stay_with_the_points_of_a_part() -> None:
    cloud = PointCloud(np.eye(3), np.arange(9, dtype=np.uint8).reshape(3, 3))
    region = Sphere(np.array([0.5, 0.5, 0.0]), 0.8)
    part, rest = split(cloud, region)
    assert isinstance(part, PointCloud)
    assert part.colors is not None
    assert part.colors.tolist() == [[0, 1, 2], [3, 4, 5]]
    assert isinstance(rest, PointCloud)
    assert rest.colors is not None
    assert rest.colors.tolist() == [[6, 7, 8]]
