"""OBJ with the habits of many programs."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.types import Mesh, PointCloud

POINTS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
FACES = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
U = ((0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3))


def _read(path: Path, text: str | bytes, merge: bool = True) -> Mesh:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    mesh = read_geometry(path, merge)
    assert isinstance(mesh, Mesh)
    return mesh


def _areas(mesh: Mesh) -> np.ndarray:
    a, b, c = np.asarray(mesh.points, float)[mesh.faces].swapaxes(0, 1)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


HABITS = {
    "carriage returns and tabs": (POINTS + FACES).replace(" ", "\t").replace("\n", " \t\r\n"),
    "carriage returns alone": (POINTS + FACES).replace("\n", "\r"),
    "byte order mark": "\ufeff" + POINTS + FACES,
    "indented lines": "  " + (POINTS + FACES).replace("\n", "\n  "),
    "lines that go on": (POINTS + FACES).replace("v 1 0 0", "v 1 \\\n 0 0").replace("f 2 3 4", "f 2 \\\n 3 4"),
    "comments behind": (POINTS + FACES).replace("\n", " # as made\n"),
    "no line end": (POINTS + FACES).rstrip(),
    "four coordinates": POINTS.replace("\n", " 1.0\n") + FACES,
    "vertices behind faces": FACES + POINTS,
    "textures of some corners": POINTS
    + "vt 0 0\n"
    + FACES.replace("f 1 3 2", "f 1/1 3/1 2").replace("f 2 3", "f 2//1 3/"),
    "normals alone": POINTS + "vn 0 0 1\n" + FACES.replace(" 1", " 1//1").replace(" 2", " 2//1").replace(" 3", " 3//1"),
    "negative numbers": POINTS + "f -4 -2 -3\nf -4 -3 -1\nf -4 -1 -2\nf -3 -2 -1\n",
}


@pytest.mark.parametrize("habit", HABITS)
def test_a_tetrahedron(tmp_path: Path, habit: str) -> None:
    mesh = _read(tmp_path / "a.obj", HABITS[habit])
    np.testing.assert_array_equal(mesh.points, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    np.testing.assert_array_equal(mesh.faces, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


@pytest.mark.parametrize("coding", ["utf-16", "utf-16-be"])
def test_sixteen_bits(tmp_path: Path, coding: str) -> None:
    data = (POINTS + FACES).encode(coding)
    assert len(_read(tmp_path / "a.obj", b"\xfe\xff" + data if coding == "utf-16-be" else data).faces) == 4


def test_negative_numbers_count_from_where_they_stand(tmp_path: Path) -> None:
    part = "f -4 -2 -3\nf -4 -3 -1\nf -4 -1 -2\nf -3 -2 -1\n"
    other = POINTS.replace("v 1", "v 6").replace("v 0", "v 5")
    mesh = _read(tmp_path / "a.obj", f"o a\n{POINTS}{part}o b\n{other}{part}")
    assert mesh.points.shape == (8, 3)
    np.testing.assert_array_equal(mesh.faces[4:] - mesh.faces[:4], np.full((4, 3), 4))
    assert mesh.points[mesh.faces[4:]].reshape(-1, 3)[:, 0].min() == 5.0


def _prism(ring: tuple, turn: np.ndarray) -> str:
    points = np.array([[x, y, z] for z in (0, 1) for x, y in ring], float) @ turn.T
    count = len(ring)
    text = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in points.tolist())
    text += f"f {' '.join(str(count - k) for k in range(count))}\n"
    text += f"f {' '.join(str(count + k + 1) for k in range(count))}\n"
    return text + "".join(
        f"f {k + 1} {(k + 1) % count + 1} {count + (k + 1) % count + 1} {count + k + 1}\n" for k in range(count)
    )


TURNS = {"flat": np.eye(3), "upright": np.eye(3)[[2, 0, 1]], "tilted": np.linalg.qr(np.vander([1.0, 2.0, 4.0]))[0]}


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("shift", range(4))
def test_polygons_that_are_not_convex(tmp_path: Path, turn: str, shift: int) -> None:
    """The caps have 7 square units, wherever the polygon starts; the body is closed, and all vertices are used."""
    ring = U[shift:] + U[:shift]
    mesh = _read(tmp_path / "a.obj", _prism(ring, TURNS[turn]))
    assert len(mesh.points) == 16
    assert _areas(mesh)[:6].sum() == pytest.approx(7.0)
    assert _areas(mesh)[6:12].sum() == pytest.approx(7.0)
    a, b, c = np.asarray(mesh.points, float)[mesh.faces].swapaxes(0, 1)
    sign = np.sign(np.linalg.det(TURNS[turn]))
    assert np.einsum("fi,fi->", a, np.cross(b, c)) / 6.0 * sign == pytest.approx(7.0)
    edges = np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_corners_at_which_a_polygon_goes_straight_on_are_kept(tmp_path: Path) -> None:
    ring = ((0, 0), (1.5, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1.5, 1), (1, 1), (1, 3), (0, 3))
    mesh = _read(tmp_path / "a.obj", _prism(ring, np.eye(3)))
    assert len(mesh.points) == 20
    assert len(mesh.faces) == 2 * 8 + 20
    assert _areas(mesh)[:8].sum() == pytest.approx(7.0)


@pytest.mark.parametrize("first", range(4))
def test_a_dart_is_cut_at_its_notch(tmp_path: Path, first: int) -> None:
    ring = [(0, 0), (2, 1), (0, 2), (0.5, 1)]
    points = "".join(f"v {x} {y} 0\n" for x, y in ring[first:] + ring[:first])
    assert _areas(_read(tmp_path / "a.obj", points + "f 1 2 3 4\n")).sum() == pytest.approx(1.5)


SEAMS = """mtllib none.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 0.5 0.5
usemtl a
f 1/1 2/2 3/3
usemtl b
f 1/2 3/1 4/3
"""


def test_without_merging_the_vertices_of_the_file_stay_in_their_order(tmp_path: Path) -> None:
    mesh = _read(tmp_path / "a.obj", SEAMS + "v 9 9 9\nv 0 0 0\n", merge=False)
    np.testing.assert_array_equal(mesh.points, [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [9, 9, 9], [0, 0, 0]])
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2], [0, 2, 3]])
    assert len(_read(tmp_path / "a.obj", SEAMS).points) == 4


def test_materials_and_textures_keep_to_their_faces(tmp_path: Path) -> None:
    (tmp_path / "tex").mkdir()
    Image.new("RGB", (4, 4), (10, 200, 30)).save(tmp_path / "tex" / "a b.png")
    (tmp_path / "my lib.mtl").write_text(
        "newmtl red\nKd 1 0 0\n\nnewmtl image\nKd 0 0 1\nmap_Kd -s 1 1 1 -clamp on tex\\a b.png\n"
    )
    text = SEAMS.replace("none.mtl", "my lib.mtl").replace("usemtl a", "usemtl image").replace("usemtl b", "usemtl red")
    colors = _read(tmp_path / "a.obj", text).colors
    assert colors is not None
    np.testing.assert_array_equal(colors[0], [[10, 200, 30]] * 3)
    np.testing.assert_array_equal(colors[1], [[255, 0, 0]] * 3)


def test_what_is_missing_is_noted(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl a\nKd 0 1 0\nmap_Kd C:\\none.png\n")
    mesh = _read(tmp_path / "a.obj", SEAMS.replace("none.mtl", "a.mtl") + "l 1 2\nl 2 3\nf 1 2\nf 1 2 3\n")
    assert mesh.notes == (
        "1 face of fewer than three corners left out",
        "2 lines left out",
        r"the texture C:\none.png left out: no such file",
    )
    assert mesh.colors is not None
    np.testing.assert_array_equal(mesh.colors[0, 0], [0, 255, 0])
    assert _read(tmp_path / "b.obj", SEAMS).notes == ("materials left out: no file none.mtl",)


@pytest.mark.parametrize("scale", [1.0, 255.0])
def test_colors_of_vertices(tmp_path: Path, scale: float) -> None:
    points = "".join(f"{line} {scale} 0 {0.2 * scale}\n" for line in POINTS.splitlines())
    colors = _read(tmp_path / "a.obj", points + FACES).colors
    assert colors is not None
    assert (colors == (255, 0, 51)).all()


@pytest.mark.parametrize("others", ["", " nan nan nan"])
def test_colors_of_some_vertices_are_noted(tmp_path: Path, others: str) -> None:
    points = POINTS.replace("\n", f"{others}\n").replace(f"v 1 0 0{others}", "v 1 0 0 1 0 0")
    mesh = _read(tmp_path / "a.obj", points + FACES)
    assert mesh.colors is None
    assert mesh.notes == ("colors left out: some vertices have none",)


def test_vertices_alone_are_points(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(POINTS.replace("\n", " 1 0 0\n"))
    cloud = read_geometry(tmp_path / "a.obj")
    assert isinstance(cloud, PointCloud)
    assert cloud.colors is not None
    assert cloud.colors.tolist() == [[255, 0, 0]] * 4


REFUSED = {
    "v -1.#IND 0 0\n" + POINTS + FACES: r"line 1: expected numbers, got '-1.#IND'",
    POINTS + "v 1.#QNAN 1.#QNAN 0\n" + FACES: r"line 5: expected numbers, got '1.#QNAN'",
    POINTS.replace("1 0 0", "1,5 0 0") + FACES: "line 2: expected numbers, got '1,5'",
    POINTS + "v 1 2": "line 5: expected 3 numbers after v, got 2: truncated",
    POINTS + FACES + "f 1 9 2\n": "line 9: refers to vertex 9, of 4",
    POINTS.replace("v 1 0", "v 1 \\\n 0") + FACES.replace("f 1", "f \\\n \\\n1") + "f 1 9 2\n": "line 16: refers to",
    POINTS + FACES + "f 1 0 2\n": "line 9: refers to vertex 0, of 4",
    POINTS + FACES + "f -5 1 2\n": "line 9: refers to vertex -5, of 4",
    POINTS + FACES + "f 1 x 2\n": "line 9: expected .*got 'x'",
    POINTS + FACES + "f 1/1 2/x 3\n": "line 9: expected corners as v, v/vt, v//vn or v/vt/vn, got '2/x'",
    POINTS + FACES + "f 1": "line 9: a face of 1 corners: truncated",
    "vt 0 0\nf 1 2 3\n": "expected lines of vertices, v x y z, got none: not an OBJ file",
    POINTS + "surf 0 1 0 1 1 2 3 4\n": "free-form curves or surfaces",
}


@pytest.mark.parametrize("text", REFUSED)
def test_refused_with_its_line(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputError, match=REFUSED[text]):
        _read(tmp_path / "a.obj", text)
