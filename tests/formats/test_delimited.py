"""Tables as spreadsheets, pandas, R, MATLAB and people write them: the same content, or refused with the cause."""

from pathlib import Path

import pytest

from odeform.errors import InputError
from odeform.formats.delimited import parse_number, read_table, with_unit

EXPECTED = [("a", 0.5, 10.0), ("b", 0.8, 10.0)]
PLAIN = "sequence,mass (kg),rate\na,0.5,10\nb,0.8,10\n"
GERMAN = "sequence;mass (kg);rate\r\na;0,5;10\r\nb;0,8;10\r\n"

SAME = {
    "plain": PLAIN.encode(),
    "without a last line end": PLAIN.encode().rstrip(),
    "byte order mark": b"\xef\xbb\xbf" + PLAIN.encode(),
    "UTF-16 of Excel": PLAIN.replace(",", "\t").encode("utf-16"),
    "UTF-16 big-endian": b"\xfe\xff" + PLAIN.encode("utf-16-be"),
    "UTF-16 without a mark": PLAIN.encode("utf-16-le"),
    "old Macs": PLAIN.replace("\n", "\r").encode(),
    "German Excel": GERMAN.encode("cp1252"),
    "sep=": b"sep=;\r\n" + GERMAN.encode(),
    "quoted SEP=": b'"SEP=;"\r\n' + GERMAN.encode(),
    "sep= comma": b"sep=,\n" + PLAIN.encode(),
    "tabs": PLAIN.replace(",", "\t").encode(),
    "bars": PLAIN.replace(",", "|").encode(),
    "semicolons with points": PLAIN.replace(",", ";").encode(),
    "tabs with decimal commas": PLAIN.replace(",", "\t").replace(".", ",").encode(),
    "blank lines": b"\n\n" + PLAIN.replace("\n", "\n\n").encode() + b"\n   \n",
    "empty rows of a spreadsheet": PLAIN.encode() + b",,\n,,\n",
    "empty rows between": PLAIN.replace("\nb", "\n,,\nb").encode(),
    "commas at the end": PLAIN.replace("\n", ",\n").encode(),
    "several commas at the end": PLAIN.replace("\n", ",,,\n").encode(),
    "commas at the end of rows only": b"sequence,mass (kg),rate\na,0.5,10,\nb,0.8,10,\n",
    "comments": b"# made by me\n%of MATLAB\n// and more\n" + PLAIN.replace("\nb", "\n# between\nb").encode(),
    "header behind #, as numpy writes": b"# " + PLAIN.encode(),
    "spaces": b" sequence ,mass (kg) ,  rate \n a , 0.5 ,10 \nb ,0.8 , 10\n",
    "quoted": b'"sequence","mass (kg)","rate"\n"a","0.5","10"\n"b" ,"0.8","10"\n',
    "quoted line break in the header": b'sequence,"mass\n(kg)",rate\na,0.5,10\nb,0.8,10\n',
    "no-break spaces": "sequence,mass\u00a0(kg),rate\n\u00a0a,0.5,10\nb\u00a0,0.8,10\n".encode(),
    "no-break spaces in Windows-1252": "sequence,mass\u00a0(kg),rate\na,0.5,10\nb,0.8,10\n".encode("cp1252"),
    "pandas with an index": b",sequence,mass (kg),rate\n0,a,0.5,10\n1,b,0.8,10\n",
    "pandas, index read and written": b"Unnamed: 0,sequence,mass (kg),rate\n0,a,0.5,10\n1,b,0.8,10\n",
    "write.csv of R": b'"","sequence","mass (kg)","rate"\n"1","a",0.5,10\n"2","b",0.8,10\n',
    "numbered rows": b"#,sequence,mass (kg),rate\n1,a,0.5,10\n2,b,0.8,10\n",
    "all quoted by LibreOffice": GERMAN.replace(";", '";"').replace("\r\n", '"\r\n"').join('""').encode()[:-2],
    "an empty column": b"sequence,,mass (kg),rate\na,,0.5,10\nb,,0.8,10\n",
    "the end of a file in CP/M": PLAIN.encode() + b"\x1a",
    "capital letters": PLAIN.replace("sequence", "Sequence").encode(),
    "exponents": b"sequence,mass (kg),rate\na,5e-1,1.0E+1\nb,+.8,10.\n",
    "German exponents": b"sequence;mass (kg);rate\na;5,0E-1;1,0E+1\nb;,8;10\n",
}


def read(data: bytes, folder: Path) -> list[tuple[str, float, float]]:
    path = folder / "parameters.csv"
    path.write_bytes(data)
    table = read_table(path, "import t", "sequence")
    assert table.header == ("sequence", "mass (kg)", "rate")
    return [(row["sequence"], *(parse_number(row[name], name) for name in table.header[1:])) for row in table.rows]


@pytest.mark.parametrize("name", SAME)
def test_tables_of_all_habits_are_the_same(name: str, tmp_path: Path) -> None:
    assert read(SAME[name], tmp_path) == EXPECTED


REFUSED = {
    "decimal commas between commas": (b"sequence,mass,rate\na,0,5,10\n", "line 2: expected 3 cells .*got 4.*commas"),
    "quoted decimal comma": (b'sequence,mass,rate\na,"0,5",10\n', "expected a number, got '0,5': .*need a point"),
    "quoted thousands": (b'sequence,mass,rate\na,"1,250",10\n', "expected a number, got '1,250': .*need a point"),
    "points and commas": (b"sequence;mass;rate\na;0,5;10\nb;0.8;10\n", "got both: 0.8 and 0,5"),
    "thousands and commas": (b"sequence;mass;rate\na;1.250,5;10\n", "expected a number, got '1.250,5'"),
    "a short row": (b"sequence,mass,rate\na,0.5,10\nb,0.8\n", "line 3: expected 3 cells .*got 2"),
    "a short row behind blank lines": (b"\n\nsequence,mass,rate\n\na,0.5\n", "line 5: expected 3 cells"),
    "no table": (b"", "expected a header with a column 'sequence', got an empty table"),
    "no column": (b"name,mass\na,0.5\n", "line 1: expected a column 'sequence', .*got 'name', 'mass'"),
    "spaces between cells": (
        b"sequence mass rate\na 0.5 10\n",
        "tabs or bars between cells, got 'sequence m",
    ),
    "another separator than stated": (b"sep=;\nsequence,mass\na,0.5\n", "';', as `sep=` says"),
    "two columns": (b"sequence,mass,mass\na,0.5,1\n", "line 1: two columns 'mass'"),
    "a column without a name": (b"sequence,,rate\na,0.5,10\n", "line 1: column 2 has no name"),
    "a column without a name at the end": (b"sequence,mass,\na,0.5,10\n", "line 2: expected 2 cells .*got 3"),
    "an open quotation mark": (b'sequence,mass\n"a,0.5\n', "line 2: .*quotation mark"),
    "a workbook": (b"PK\x03\x04rest", "an Excel or OpenDocument workbook.*save the table as CSV"),
    "an old workbook": (b"\xd0\xcf\x11\xe0rest", "an old Excel workbook"),
    "a packed file": (b"\x1f\x8b\x08rest", "a gzip archive: unpack it first"),
    "a web page": (b"<!doctype html><title>404</title>", "got a web page"),
    "a pointer": (b"version https://git-lfs.github.com/spec/v1\n", "a pointer of Git LFS"),
    "no text": (b"sequence,mass\n\x81\x8d\n", "byte 14 is in none"),
    "half a UTF-16": (PLAIN.encode("utf-16")[:-1], "expected UTF-16-LE text"),
    "zeros": (b"sequence,mass\na,\0\0\n", "zero character"),
    "units of a cell": (b"sequence,mass,rate\na,0.5 kg,10\n", "expected a number, got '0.5 kg'"),
    "an error of a spreadsheet": (b"sequence,mass,rate\na,#DIV/0!,10\n", "expected a number, got '#DIV/0!'"),
    "an empty cell": (b"sequence,mass,rate\na,,10\n", "expected a number, got ''"),
    "not a number": (b"sequence,mass,rate\na,NaN,10\n", "expected a number, got 'NaN'"),
    "digits grouped as in Python": (b"sequence,mass,rate\na,1_000,10\n", "expected a number, got '1_000'"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_others_are_refused_with_the_cause(name: str, tmp_path: Path) -> None:
    data, message = REFUSED[name]
    path = tmp_path / "parameters.csv"
    path.write_bytes(data)

    def read_numbers() -> list[float]:
        rows = read_table(path, "import t", "sequence").rows
        return [parse_number(cell, "cell") for row in rows for column, cell in row.items() if column != "sequence"]

    with pytest.raises(InputError, match=message):
        read_numbers()


def test_guesses_are_said(tmp_path: Path) -> None:
    def notes(data: bytes) -> tuple[str, ...]:
        path = tmp_path / "parameters.csv"
        path.write_bytes(data)
        return read_table(path, "import t", "sequence").notes

    assert notes(PLAIN.encode()) == notes(GERMAN.encode()) == ()
    for mark in (b",", b"."):
        ambiguous = b"sequence;mass\na;1%s250\nb;2%s500\n" % (mark, mark)
        assert "250 is read as a decimal, not as thousands" in notes(ambiguous)[0]
    assert notes(b"sequence;mass\na;1,250\nb;0,500\n") == ()
    assert "Windows-1252" in notes("sequence,Stärke\na,0.5\n".encode("cp1252"))[0]
    assert "first column" in notes(SAME["pandas with an index"])[0]


@pytest.mark.parametrize(
    ("column", "expected"),
    [
        ("mass (kg)", ("mass", "kg")),
        ("mass [kg]", ("mass", "kg")),
        ("mass(kg)", ("mass", "kg")),
        ("mass[ kg ]", ("mass", "kg")),
        ("bending [N m]", ("bending", "N m")),
        ("stiffness (spring) (N/m)", ("stiffness (spring)", "N/m")),
        ("mass", ("mass", "")),
        ("mass ()", ("mass", "")),
    ],
)
def test_units_are_in_brackets(column: str, expected: tuple[str, str]) -> None:
    assert with_unit(column) == expected
