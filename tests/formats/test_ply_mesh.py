"""PLY meshes and points with the habits of many programs."""

import struct
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.types import GaussianSplats, Mesh, PointCloud

XYZ = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
VERTEX = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
FACE = "element face 4\nproperty list uchar int vertex_indices\n"
ROWS = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
LISTS = "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"


def _head(body: str, form: str = "ascii") -> str:
    return f"ply\nformat {form} 1.0\n{body}end_header\n"


def _read(path: Path, content: str | bytes, merge: bool = True) -> Mesh:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    mesh = read_geometry(path, merge)
    assert isinstance(mesh, Mesh)
    return mesh


TEXT = _head(VERTEX + FACE) + ROWS + LISTS
HABITS = {
    "carriage returns alone": TEXT.replace("\n", "\r"),
    "both line ends": TEXT.replace("\n", "\r\n"),
    "tabs": TEXT.replace("0 0", "0\t0"),
    "blank line behind the header": _head(VERTEX + FACE) + "\n" + ROWS + "\n" + LISTS,
    "mark before the data": _head(VERTEX + FACE) + "\ufeff" + ROWS + LISTS,
    "mark before the header": "\ufeff" + TEXT,
    "no line end": TEXT.rstrip(),
    "comment that goes on": TEXT.replace("element face", "comment made by\nsomebody, elsewhere\nelement face"),
    "other name of the list": TEXT.replace("vertex_indices", "vertex_index"),
    "spaces behind the header": TEXT.replace("end_header\n", "end_header  \n"),
}


@pytest.mark.parametrize("habit", HABITS)
def test_a_tetrahedron(tmp_path: Path, habit: str) -> None:
    mesh = _read(tmp_path / "a.ply", HABITS[habit])
    np.testing.assert_array_equal(mesh.points, XYZ)
    np.testing.assert_array_equal(mesh.faces, FACES)


@pytest.mark.parametrize(("form", "order"), [("binary_little_endian", "<"), ("binary_big_endian", ">")])
@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_binary_faces_of_several_sizes(tmp_path: Path, form: str, order: str, newline: str) -> None:
    """A list of one length, of several, and with columns around it."""
    head = _head(VERTEX + "element face 3\nproperty uchar red\nproperty list uchar int vertex_indices\n", form)
    square = [[10, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]  # the first byte of the data may be a line feed
    data = b"".join(struct.pack(f"{order}3f", *xyz) for xyz in square)
    for sizes in ([3, 3, 3], [3, 4, 3]):
        faces = b"".join(struct.pack(f"{order}BB{n}i", 7, n, *range(n)) for n in sizes)
        mesh = _read(tmp_path / "a.ply", head.replace("\n", newline).encode() + data + faces, merge=False)
        np.testing.assert_array_equal(mesh.points, square)
        assert len(mesh.faces) == sum(n - 2 for n in sizes)
    with pytest.raises(InputError, match="expected 3 rows of face, got 2: truncated"):
        _read(tmp_path / "a.ply", head.replace("\n", newline).encode() + data + faces[:-2])


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
def test_triangle_strips(tmp_path: Path, form: str) -> None:
    """Every other triangle of a strip is turned around, and counting starts anew after -1."""
    strip = [0, 1, 2, 3, -1, 0, 2, 1]
    head = _head(VERTEX + "element tristrips 1\nproperty list int int vertex_indices\n", form)
    body = (ROWS + f"8 {' '.join(map(str, strip))}\n").encode()
    if form != "ascii":
        body = np.array(XYZ, "<f4").tobytes() + np.array([8, *strip], "<i4").tobytes()
    np.testing.assert_array_equal(
        _read(tmp_path / "a.ply", head.encode() + body).faces, [[0, 1, 2], [1, 3, 2], [0, 2, 1]]
    )


COLORED = VERTEX + "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
PAINTED = "".join(f"{row} 255 10 20\n" for row in ROWS.splitlines())


STRIP = "element tristrips 1\nproperty list int int vertex_indices\n"


def test_strips_beside_no_faces_and_beside_faces(tmp_path: Path) -> None:
    alone = _read(tmp_path / "a.ply", _head(VERTEX + FACE.replace("4", "0") + STRIP) + ROWS + "4 0 1 2 3\n")
    assert alone.faces.tolist() == [[0, 1, 2], [1, 3, 2]]
    assert alone.notes == ()
    both = _read(tmp_path / "b.ply", _head(VERTEX + FACE + STRIP) + ROWS + LISTS + "4 0 1 2 3\n")
    assert len(both.faces) == 4
    assert both.notes == ("1 strip beside the faces left out",)


def test_other_elements_are_noted(tmp_path: Path) -> None:
    """As the scanners of Stanford wrote them: a grid of the points that were seen."""
    grid = "element range_grid 2\nproperty list uchar int vertex_indices\n"
    (tmp_path / "a.ply").write_text(_head(VERTEX + grid) + ROWS + "1 0\n0\n")
    cloud = read_geometry(tmp_path / "a.ply")
    assert isinstance(cloud, PointCloud)
    assert cloud.notes == ("2 rows of range_grid left out",)


def test_colors_of_points(tmp_path: Path) -> None:
    (tmp_path / "a.ply").write_text(_head(COLORED) + PAINTED)
    cloud = read_geometry(tmp_path / "a.ply")
    assert isinstance(cloud, PointCloud)
    assert cloud.colors is not None
    assert cloud.colors.tolist() == [[255, 10, 20]] * 4


def test_colors_of_vertices_and_faces(tmp_path: Path) -> None:
    of_vertices = _read(tmp_path / "a.ply", _head(COLORED + FACE) + PAINTED + LISTS).colors
    assert of_vertices is not None
    assert (of_vertices == (255, 10, 20)).all()
    floats = "".join(f"property float {name}\n" for name in ("red", "green", "blue"))
    lists = "".join(f"{row} 1.0 0.2 {0.2 * k}\n" for k, row in enumerate(LISTS.splitlines()))
    of_faces = _read(tmp_path / "b.ply", _head(VERTEX + FACE + floats) + ROWS + lists).colors
    assert of_faces is not None
    assert of_faces[:, 1].tolist() == [[255, 51, 51 * k] for k in range(4)]


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
def test_colors_of_sixteen_bits(tmp_path: Path, form: str) -> None:
    head = _head(COLORED.replace("uchar", "ushort"), form).encode()
    if form == "ascii":
        data = "".join(f"{row} 65535 0 32768\n" for row in ROWS.splitlines()).encode()
    else:
        data = b"".join(struct.pack("<3f3H", *row, 65535, 0, 32768) for row in XYZ)
    (tmp_path / "a.ply").write_bytes(head + data)
    cloud = read_geometry(tmp_path / "a.ply")
    assert isinstance(cloud, PointCloud)
    assert cloud.colors is not None
    assert cloud.colors.tolist() == [[255, 0, 128]] * 4


def test_a_missing_texture_is_noted_without_a_traceback(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    text = TEXT.replace(
        "element vertex", "comment é ü\nobj_info by hand\ncomment TextureFile no such.png\nelement vertex"
    )
    assert _read(tmp_path / "a.ply", text).notes == ("the texture no such.png left out: no such file",)
    assert "".join(capfd.readouterr()) == caplog.text == ""


def test_several_textures_are_noted(tmp_path: Path) -> None:
    text = TEXT.replace("element vertex", "comment TextureFile a.png\ncomment TextureFile b.png\nelement vertex")
    assert _read(tmp_path / "a.ply", text).notes == ("2 textures left out: one is read at most",)


def test_a_texture_of_the_corners_of_faces(tmp_path: Path) -> None:
    Image.new("RGB", (4, 4), (10, 200, 30)).save(tmp_path / "my image.png")
    lists = "".join(f"{row} 6 0 0 1 0 0 1\n" for row in LISTS.splitlines())
    body = "comment TextureFile my image.png\n" + VERTEX + FACE + "property list uchar float texcoord\n"
    colors = _read(tmp_path / "a.ply", _head(body) + ROWS + lists).colors
    assert colors is not None
    assert (colors == (10, 200, 30)).all()


def test_rows_of_faces_with_more_than_the_header_says(tmp_path: Path) -> None:
    colored = FACE + "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
    lists = "".join(f"{row} 9 1 1 1 1 1 1 1 1 1\n" for row in LISTS.splitlines())
    mesh = _read(tmp_path / "a.ply", _head(VERTEX + colored) + ROWS + lists)
    assert mesh.colors is None
    assert len(mesh.faces) == 4


REFUSED = {
    _head(VERTEX.replace("4", "9") + FACE) + ROWS + LISTS: "expected 9 rows of vertex, got 8: truncated",
    _head(VERTEX.replace("4", "5") + FACE) + ROWS + LISTS: "line 14: expected a row of vertex .x y z., got 4 numbers",
    _head(VERTEX + FACE) + ROWS + LISTS[:-9]: "expected 4 rows of face, got 3: truncated",
    _head(VERTEX + FACE) + ROWS + LISTS[:-3]: "line 17: expected a row of face .list vertex_indices., got 3 numbers",
    _head(VERTEX + FACE) + ROWS.replace("1 0 0", "1.#INF 0 0") + LISTS: "line 11: expected numbers, got '1.#INF'",
    _head(VERTEX + FACE) + ROWS + LISTS.replace("3 0 2 1", "3 0 2 9"): "face 1 refers to vertex 9, of 4",
    _head(VERTEX.replace("float x", "quad x")) + ROWS: "line 4: expected a line of a PLY header, got 'property quad x'",
    _head(VERTEX.replace("float z", "float w")) + ROWS: "expected an element vertex with x, y and z, got x, y, w",
    "ply\nformat ascii 1.0\nelement vertex 4\n": "expected a header that ends in end_header, .*truncated",
    "ply\nelement vertex 4\nend_header\n": "expected a header with a format of",
    "a cloud of points\n": "expected ply in the first line, got b'a cloud of points",
    "PK\x03\x04 and so on": "got a zip archive",
}


@pytest.mark.parametrize("text", REFUSED)
def test_refused_with_its_line(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputError, match=REFUSED[text]):
        _read(tmp_path / "a.ply", text)


SPLAT = ("x", "y", "z", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3")


def _splats(path: Path, names: tuple[str, ...], kinds: dict[str, str], rows: list[tuple]) -> GaussianSplats:
    layout = np.dtype([(name, {"uchar": "u1", "double": "f8"}.get(kinds.get(name, ""), "<f4")) for name in names])
    head = "".join(f"property {kinds.get(name, 'float')} {name}\n" for name in names)
    text = _head(f"element vertex {len(rows)}\n{head}", "binary_little_endian")
    path.write_bytes(text.encode() + np.array(rows, layout).tobytes())
    splats = read_geometry(path)
    assert isinstance(splats, GaussianSplats)
    return splats


def test_splats_with_red_green_and_blue(tmp_path: Path) -> None:
    names = (*SPLAT, "red", "green", "blue")
    rows = [(k, 0, 0, 0, -1, -1, -1, 1, 0, 0, 0, 255, 10, 20) for k in range(3)]
    splats = _splats(tmp_path / "a.ply", names, dict.fromkeys(("red", "green", "blue"), "uchar"), rows)
    np.testing.assert_allclose(splats.colors * 255.0, [[255, 10, 20]] * 3, atol=1e-3)
    assert splats.notes == ()


def test_flat_splats_of_two_scales(tmp_path: Path) -> None:
    names = (*SPLAT[:6], *SPLAT[7:], "f_dc_0", "f_dc_1", "f_dc_2")
    rows = [(k, 0, 0, 0, np.log(0.1), np.log(0.2), 1, 0, 0, 0, 1, 1, 1) for k in range(3)]
    splats = _splats(tmp_path / "a.ply", names, {}, rows)
    np.testing.assert_allclose(splats.covariances, [np.diag([0.01, 0.04, 0.0])] * 3, atol=1e-8)
    assert splats.notes == ("flat splats, of two scales",)


def test_splats_far_away_keep_their_places(tmp_path: Path) -> None:
    rows = [(4e6 + 0.25 * k, 5e6, 0, 0, -1, -1, -1, 1, 0, 0, 0) for k in range(3)]
    splats = _splats(tmp_path / "a.ply", SPLAT, dict.fromkeys("xyz", "double"), rows)
    np.testing.assert_allclose(np.diff(splats.points[:, 0]), 0.25, atol=1e-6)


def test_what_follows_the_last_row_is_noted(tmp_path: Path) -> None:
    text = _read(tmp_path / "a.ply", _head(VERTEX + FACE) + ROWS + LISTS + "3 0 1 2\n")
    assert (len(text.faces), text.notes) == (4, ("1 line after the last row left out",))
    faces = b"".join(struct.pack("<B3i", 3, *face) for face in FACES)
    data = _head(VERTEX + FACE, "binary_little_endian").encode() + np.array(XYZ, "<f4").tobytes() + faces
    assert _read(tmp_path / "b.ply", data).notes == ()
    assert _read(tmp_path / "b.ply", data + bytes(12)).notes == ("12 bytes after the last row left out",)
