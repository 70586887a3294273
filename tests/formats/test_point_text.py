"""Points as text, as scanners and programs write them."""

from pathlib import Path

import numpy as np
import pytest

from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.types import PointCloud

POINTS = np.array([[-1.3519, -0.6626, 2.0], [0.8794, 1.6041, 0.3597], [2.5, -0.73, 0.4286]])
ROWS = "\n".join(" ".join(map(str, row)) for row in POINTS.tolist()) + "\n"
COLORED = ROWS.replace("\n", " 10 20 30\n")
RGB = [10, 20, 30]


def _read(path: Path, content: str | bytes) -> PointCloud:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    cloud = read_geometry(path)
    assert isinstance(cloud, PointCloud)
    return cloud


HABITS = {
    "plain": (ROWS, None),
    "tabs": (ROWS.replace(" ", "\t"), None),
    "both line ends": (ROWS.replace("\n", "\r\n"), None),
    "carriage returns alone": (ROWS.replace("\n", "\r"), None),
    "byte order mark": ("\ufeff" + ROWS, None),
    "empty rows of a table": (ROWS.replace(" ", ",") + ",,\n,,\n", None),
    "blank lines": (ROWS.replace("\n", "\n\n"), None),
    "commas": (ROWS.replace(" ", ", "), None),
    "commas at the end": (ROWS.replace(" ", ",").replace("\n", ",\n"), None),
    "semicolons": (ROWS.replace(" ", ";"), None),
    "decimal commas and semicolons": (ROWS.replace(" ", ";").replace(".", ","), None),
    "decimal commas and tabs": (ROWS.replace(" ", "\t").replace(".", ","), None),
    "decimal commas, commas and spaces": (ROWS.replace(".", ",").replace(" ", ", "), None),
    "Excel's first line": ("sep=;\n" + ROWS.replace(" ", ";").replace(".", ","), None),
    "decimal commas and spaces": (ROWS.replace(".", ","), None),
    "a count": ("3\n" + ROWS, None),
    "comments": ("# made here\n% or there\n" + ROWS, None),
    "CloudCompare's header": ("//X Y Z R G B\n" + COLORED, RGB),
    "CloudCompare's header and count": ("//X Y Z R G B\n3\n" + COLORED, RGB),
    "names": ("x,y,z,r,g,b\n" + COLORED.replace(" ", ","), RGB),
    "names in quotes": ('"X","Y","Z"\n' + ROWS.replace(" ", ","), None),
    "names with units": ("x [m];y [m];z [m]\n" + ROWS.replace(" ", ";"), None),
    "ParaView's names": ('"Points:0","Points:1","Points:2"\n' + ROWS.replace(" ", ","), None),
    "colors without names": (COLORED, RGB),
    "intensity and colors": (ROWS.replace("\n", " 0.7 10 20 30\n"), RGB),
    "normals": (ROWS.replace("\n", " 0.0 0.6 0.8\n"), None),
}


@pytest.mark.parametrize("suffix", ["xyz", "txt", "csv", "asc", "pts"])
@pytest.mark.parametrize("habit", HABITS)
def test_points(tmp_path: Path, habit: str, suffix: str) -> None:
    content, color = HABITS[habit]
    cloud = _read(tmp_path / f"a.{suffix}", content)
    np.testing.assert_allclose(cloud.points, POINTS.astype(np.float32))
    assert (cloud.colors is None) == (color is None)
    if cloud.colors is not None:
        assert cloud.colors.tolist() == [color] * 3


def test_named_columns_in_any_order(tmp_path: Path) -> None:
    rows = "\n".join(f"{i},{z},{x},{y}" for i, (x, y, z) in enumerate(POINTS.tolist()))
    cloud = _read(tmp_path / "a.csv", f"id,z,x,y\n{rows}\n")
    np.testing.assert_allclose(cloud.points, POINTS.astype(np.float32))
    assert cloud.notes == ("1 further columns left out",)


@pytest.mark.parametrize("mark", ["\ufeff", ""], ids=["with a mark", "without"])
@pytest.mark.parametrize("coding", ["utf-16-le", "utf-16-be"])
def test_sixteen_bits(tmp_path: Path, coding: str, mark: str) -> None:
    assert len(_read(tmp_path / "a.txt", (mark + ROWS).encode(coding)).points) == 3


REFUSED = {
    ROWS + "1 2\n": "line 4: expected 3 numbers as in line 1, got 2: truncated",
    ROWS.replace("0.8794", "0.8794 7"): "line 2: expected 3 numbers as in line 1, got 4",
    "1 2\n3 4\n5 7\n": "line 1: expected three numbers x y z in each line, got 2",
    "9\n" + ROWS: "expected 9 points as its first line says, got 3: truncated",
    "//X Y Z R G B\n" + ROWS: "expected 6 numbers in each line, as named, got 3",
    ROWS.replace("1.6041", "1.#QNAN"): "line 2: expected numbers, got '1.#QNAN'",
    "C 0 0 0\nH 0 0 1\n": "expected lines of numbers x y z, got 'C 0 0 0'",
    "a,b,c\n1,2,3\n": "expected lines of numbers x y z, got 'a,b,c'",
    "x;y;z\n1.234,5;2;3\n0;0;0\n1;1;1\n": "line 2: expected lines of numbers x y z, got '1.234,5;2;3'",
    "0,0,0\n1,5,0,0\n0,0,1,5\n": "line 2: expected 3 numbers as in line 1, got 4: are there decimal commas",
    "": "an empty file",
    "<!DOCTYPE html><html>": "got a page of HTML",
}


@pytest.mark.parametrize("text", REFUSED)
def test_refused_with_its_line(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputError, match=REFUSED[text]):
        _read(tmp_path / "a.xyz", text)


@pytest.mark.parametrize("separator", [";", "\t", " "])
def test_whole_numbers_before_decimal_commas(tmp_path: Path, separator: str) -> None:
    cloud = _read(tmp_path / "a.csv", "0;0;0\n1,5;2;3\n1e2;0;,5\n".replace(";", separator))
    np.testing.assert_array_equal(cloud.points, np.array([[0, 0, 0], [1.5, 2, 3], [100, 0, 0.5]], np.float32))
