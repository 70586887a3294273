from pathlib import Path

import numpy as np
import pytest

from odeform.errors import InputError
from odeform.formats.ply import Table, columns, read_header
from odeform.formats.ply_data import read_tables


def read_ply_tables(path: Path) -> dict[str, Table]:
    return read_tables(path, read_header(path))


ROWS = np.array([[1.5, -2.0, 3.25], [0.1, 1e-3, -7.0]])


def header(form: str, *lines: str, newline: str = "\n") -> bytes:
    return newline.join(["ply", f"format {form} 1.0", "comment made here", *lines, "end_header", ""]).encode()


POINTS = ("element vertex 2", "property float x", "property double y", "property float z")


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
@pytest.mark.parametrize(("form", "order"), [("binary_little_endian", "<"), ("binary_big_endian", ">")])
def test_binary(tmp_path: Path, form: str, order: str, newline: str) -> None:
    data = np.zeros(2, [("x", f"{order}f4"), ("y", f"{order}f8"), ("z", f"{order}f4")])
    for name, column in zip("xyz", ROWS.T, strict=True):
        data[name] = column
    words = np.array([7, 2**32 - 1], f"{order}u4")
    path = tmp_path / "a.ply"
    head = header(form, *POINTS, "element extra 2", "property uint32 id", newline=newline)
    path.write_bytes(head + data.tobytes() + words.tobytes())
    tables = read_ply_tables(path)
    assert [[entry.name for entry in element.properties] for element in read_header(path).elements] == [
        [*"xyz"],
        ["id"],
    ]
    assert np.allclose(columns(tables["vertex"], ["z", "x", "y"], path), ROWS[:, [2, 0, 1]])
    assert tables["extra"]["id"].tolist() == [7, 2**32 - 1]


def test_text(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    rows = "\n".join(" ".join(map(str, row)) for row in ROWS)
    path.write_bytes(header("ascii", *POINTS, "element extra 1", "property uint id") + f"{rows}\n4294967295\n".encode())
    tables = read_ply_tables(path)
    assert np.allclose(columns(tables["vertex"], "xyz", path), ROWS)
    assert tables["extra"]["id"].tolist() == [2**32 - 1]


def test_lists_are_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    head = header(
        "binary_little_endian", POINTS[0], POINTS[1], "element face 1", "property list uchar int vertex_index"
    )
    path.write_bytes(head + np.zeros(2, "<f4").tobytes() + b"\x00")
    assert list(read_ply_tables(path)) == ["vertex"]


@pytest.mark.parametrize("form", ["binary_little_endian", "ascii"])
def test_too_few_rows(tmp_path: Path, form: str) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(header(form, "element vertex 900", "property float x") + b"1\n2\n3\n4\n")
    with pytest.raises(InputError, match=r"expected 900 rows of vertex, got [24]"):
        read_ply_tables(path)


def test_no_ply(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    for content in (b"", b"ply\n", b"hello end_header\n", b"ply\nformat cuneiform 1.0\nend_header\n"):
        path.write_bytes(content)
        with pytest.raises(InputError, match=r"header|ply in the first line"):
            read_ply_tables(path)


def test_a_missing_column(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(header("binary_little_endian", "element vertex 0", "property float x"))
    with pytest.raises(InputError, match="without y, z"):
        columns(read_ply_tables(path)["vertex"], "xyz", path)
