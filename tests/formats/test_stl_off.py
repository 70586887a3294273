"""STL and OFF with the habits of many programs."""

import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh

from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.types import Mesh

TETRAHEDRON = trimesh.Trimesh(
    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], process=False
)
BINARY: bytes = TETRAHEDRON.export(file_type="stl")
TEXT: str = TETRAHEDRON.export(file_type="stl_ascii")


def _read(path: Path, content: str | bytes) -> Mesh:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    mesh = read_geometry(path)
    assert isinstance(mesh, Mesh)
    return mesh


STL = {
    "binary": BINARY,
    "binary that says solid": b"solid facet normal".ljust(80) + BINARY[80:],
    "text": TEXT,
    "text in capitals": TEXT.upper(),
    "text with both line ends": TEXT.replace("\n", "\r\n"),
    "text in one line": " ".join(TEXT.split()),
    "text with a mark": "\ufeff" + TEXT,
    "text of several solids": TEXT.replace("solid", "solid one", 1).replace(
        "endsolid", "endsolid x\nsolid vertex\nendsolid"
    ),
}


@pytest.mark.parametrize("habit", STL)
def test_stl(tmp_path: Path, habit: str) -> None:
    mesh = _read(tmp_path / "a.stl", STL[habit])
    assert len(mesh.points) == 4
    made = trimesh.Trimesh(mesh.points, mesh.faces, process=False)
    assert made.is_watertight
    assert made.volume == pytest.approx(1 / 6)
    assert mesh.notes == ()


def test_what_follows_a_binary_stl_and_its_colors_are_noted(tmp_path: Path) -> None:
    assert _read(tmp_path / "a.stl", BINARY + b"trailer").notes == ("7 bytes after the last triangle left out",)
    colored = bytearray(BINARY)
    colored[84 + 48 : 84 + 50] = b"\xff\x00"
    assert _read(tmp_path / "a.stl", bytes(colored)).notes == ()  # no color without its bit
    colored[84 + 48 : 84 + 50] = b"\xff\x80"
    assert _read(tmp_path / "a.stl", bytes(colored)).notes == ("colors of triangles left out",)
    colored[:6] = b"COLOR="
    colored[84 + 48 : 84 + 50] = b"\xff\x80"
    assert _read(tmp_path / "a.stl", bytes(colored)).notes == ("colors of triangles left out",)


STL_REFUSED = {
    "cut": (BINARY[:-30], "expected 284 bytes of 4 triangles of a binary STL, got 254: truncated"),
    "cut in its header": (b"made by hand", "truncated"),
    "no triangles": (b"made by hand".ljust(80) + bytes(4), "expected triangles, got a binary STL of none"),
    "text cut between facets": (TEXT[: TEXT.rindex("facet normal")].encode(), "no endsolid: truncated"),
    "text cut in a vertex": (
        TEXT[: TEXT.rindex("vertex") + 9].encode(),
        "expected three numbers of a vertex, got 1: trunc",
    ),
    "text cut in a facet": (
        TEXT[: TEXT.rindex("vertex")].encode(),
        "expected three vertices for each facet, got 11 for 4",
    ),
    "a word": (TEXT.replace("vertex 1", "vertex 1.#INF", 1).encode(), "line .*: expected numbers, got '1.#inf"),
    "anything": (b"hello world " * 60, "no STL file"),
}


@pytest.mark.parametrize("fault", STL_REFUSED)
def test_stl_refused(tmp_path: Path, fault: str) -> None:
    content, said = STL_REFUSED[fault]
    with pytest.raises(InputError, match=said):
        _read(tmp_path / "a.stl", content)


ROWS = ("0 0 0", "1 0 0", "0 1 0", "0 0 1")
FACES = ("3 0 2 1", "3 0 1 3", "3 0 3 2", "3 1 2 3")
RED = [[255, 0, 0]] * 3


def _off(keyword: str, rows: tuple[str, ...] | list[str] = ROWS, faces: tuple[str, ...] | list[str] = FACES) -> str:
    return "\n".join([keyword, "4 4 6", *rows, *faces, ""])


OFF = {
    "plain": (_off("OFF"), None),
    "no keyword": (_off("OFF").removeprefix("OFF\n"), None),
    "numbers beside the keyword": (_off("OFF").replace("OFF\n", "OFF "), None),
    "numbers at the keyword": (_off("OFF").replace("OFF\n", "OFF"), None),
    "comments and blanks": (_off("OFF").replace("\n", " # why not\n\n"), None),
    "both line ends": (_off("OFF").replace("\n", "\r\n"), None),
    "COFF of bytes": (_off("COFF", [f"{row} 255 0 0 255" for row in ROWS]), RED),
    "COFF of fractions": (_off("COFF", [f"{row} 1.0 0.0 0.0 1.0" for row in ROWS]), RED),
    "CNOFF": (_off("CNOFF", [f"{row} 0 0 1 255 0 0 255" for row in ROWS]), RED),
    "STCOFF": (_off("STCOFF", [f"{row} 255 0 0 255 0.5 0.5" for row in ROWS]), RED),
    "NOFF": (_off("NOFF", [f"{row} 0 0 1" for row in ROWS]), None),
    "faces of bytes": (_off("OFF", faces=[f"{face} 255 0 0" for face in FACES]), RED),
    "faces of fractions": (_off("OFF", faces=[f"{face} 1 0 0 1" for face in FACES]), RED),
}


@pytest.mark.parametrize("habit", OFF)
def test_off(tmp_path: Path, habit: str) -> None:
    content, colors = OFF[habit]
    mesh = _read(tmp_path / "a.off", content)
    np.testing.assert_array_equal(mesh.points, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    np.testing.assert_array_equal(mesh.faces, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    assert (mesh.colors is None) == (colors is None)
    if mesh.colors is not None:
        assert mesh.colors[0].tolist() == colors


OFF_REFUSED = {
    "cut": (_off("OFF")[:-9], "expected 4 vertices and 4 faces, one in each line, got 7 lines: truncated"),
    "cut in a face": (_off("OFF")[:-3], "line 10: expected a face of 3 vertices, got 2 numbers: truncated"),
    "binary": ("OFF BINARY\n" + "\0" * 99, "expected text that starts with OFF"),
    "four dimensions": (_off("4OFF"), "expected text that starts with OFF"),
    "n dimensions": (_off("nOFF"), "expected text that starts with OFF"),
    "a word": (_off("OFF").replace("0 1 0", "0 one 0"), "line 5: expected numbers, got 'one'"),
    "beyond the vertices": (_off("OFF").replace("3 1 2 3", "3 1 2 4"), "line 10: refers to vertex 4, of 4"),
    "a face of far too many": (_off("OFF").replace("3 1 2 3", "9" * 20 + " 1 2 3"), "line 10: expected a face of"),
    "two coordinates": (_off("OFF", [row[:3] for row in ROWS]), "line 3: expected 3 numbers of a vertex, got 2"),
}


@pytest.mark.parametrize("fault", OFF_REFUSED)
def test_off_refused(tmp_path: Path, fault: str) -> None:
    content, said = OFF_REFUSED[fault]
    with pytest.raises(InputError, match=said):
        _read(tmp_path / "a.off", content)


def test_a_count_of_triangles_that_is_too_small_is_not_believed(tmp_path: Path) -> None:
    wrong = BINARY[:80] + struct.pack("<I", 1) + BINARY[84:]
    with pytest.raises(InputError, match="expected 134 bytes of 1 triangles"):
        _read(tmp_path / "a.stl", wrong)
