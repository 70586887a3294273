"""Folders of frames and their table, as other programs leave them: imported as they are meant, or refused in a line."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from authors import TETRAHEDRON
from user_sequences import TABLE, WITHOUT_RATE, folder, heights, imported, obj, refused, refused_all, shape, stl

from odeform.cli import main
from odeform.dataset.importers.registry import import_dataset
from odeform.errors import InputError


def test_frames_are_in_the_order_of_their_values(tmp_path: Path) -> None:
    names = [f"frame_{number}.obj" for number in range(-3, 3)]
    dataset, sequence = imported(folder(tmp_path / "src", names, [0.1 * k for k in range(6)]))
    assert heights(sequence) == [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]
    assert np.allclose(sequence.times, 0.1 * np.arange(6))
    assert "notes" not in dataset.provenance


def test_times_in_names_are_doubted_aloud(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    uneven = folder(tmp_path / "u", [f"m_{t}.obj" for t in (0, 0.1, 0.25, 0.5, 1)], [0.0, 0.1, 0.25, 0.5, 1.0])
    assert main(["import", str(uneven), "--out", str(tmp_path / "out")]) == 0
    assert "note: a and 1 more: the numbers in the names are uneven" in capsys.readouterr().err
    _, sequence = imported(uneven)
    assert heights(sequence) == [0.0, 0.1, 0.25, 0.5, 1.0]
    even = folder(tmp_path / "e", [f"Result-{t}.obj" for t in ("0.0005", "0.001", "0.0015")], [0.0, 0.1, 0.2])
    dataset, sequence = imported(even)
    assert heights(sequence) == [0.0, 0.1, 0.2]
    assert "if these are seconds, the rate is 2000 Hz, not 10" in dataset.provenance["notes"][0]
    dataset, _ = imported(even, rate=2000.0)
    assert "notes" not in dataset.provenance
    (even / "parameters.csv").write_text(WITHOUT_RATE)
    with pytest.raises(InputError, match=r"a counts in steps of 0.0005: if these are seconds, --rate 2000"):
        imported(even)


def test_what_frames_hold_beside_their_mesh_is_noted(tmp_path: Path) -> None:
    def with_lines(path: Path, points: np.ndarray) -> None:
        obj(path, points)
        path.write_text(path.read_text() + "\nl 1 2\nl 2 3\n")

    dataset, _ = imported(folder(tmp_path / "src", ["f_0.obj", "f_1.obj"], [0.0, 0.1], with_lines))
    assert dataset.provenance["notes"] == ["a and 1 more: 2 lines left out"]


def test_steps_in_the_numbers_are_said_and_the_same_in_all_sequences(tmp_path: Path) -> None:
    root = folder(tmp_path / "src", ["f_0.obj", "f_5.obj", "f_10.obj"], [0.0, 0.1, 0.2])
    dataset, sequence = imported(root)
    assert np.allclose(sequence.times, [0.0, 0.1, 0.2])
    assert "steps of 5; they are taken 0.1 s apart" in dataset.provenance["notes"][0]
    (root / "b/f_5.obj").rename(root / "b/f_1.obj")
    (root / "b/f_10.obj").rename(root / "b/f_2.obj")
    with pytest.raises(InputError, match=r"numbered as in a, in steps of 5, got steps of 1: .*are frames missing"):
        imported(root)


def test_a_table_of_times_is_the_clock(tmp_path: Path) -> None:
    root = folder(tmp_path / "src", ["x.obj", "f_1.obj", "f_2.obj", "f_7.obj"], [0.0, 0.1, 0.2, 0.7])
    for name in ("a", "b"):
        (root / name / "times.csv").write_text("file;time [ms]\nf_7.obj;700,0\nx;0,0\nf_2;200,0\nf_1.obj;100,0\n")
    dataset, sequence = imported(root)
    assert heights(sequence) == [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]
    assert "resampled from uneven times" in dataset.provenance["notes"][0]
    (root / "a/times.csv").write_text("file,time\nx,0\nf_1,0.1\n")
    with pytest.raises(InputError, match=r"times.csv: expected a time for each frame, got none for f_2.obj"):
        imported(root)
    (root / "a/times.csv").write_text("file,time\nx,0\nf_1,0.1\nf_2,0.1\nf_7,0.7\n")
    with pytest.raises(InputError, match="times that increase"):
        imported(root)


def test_frames_that_are_missing_or_there_twice_are_refused(tmp_path: Path) -> None:
    refused(folder(tmp_path / "gap", ["f_0.obj", "f_1.obj", "f_3.obj"], [0.0, 0.1, 0.3]), "gap/a: frame 2 is missing")
    names = ["f_0.obj", "f_1.obj", "f_1 (1).obj", "f_2.obj"]
    refused(folder(tmp_path / "copy", names, [0.0, 0.1, 0.1, 0.2]), r"got also f_1 \(1\).obj: copies")
    twins = folder(tmp_path / "twins", ["f_0.obj", "f_1.obj"], [0.0, 0.1])
    for frame in ("f_0.ply", "f_1.ply"):
        stl(twins / "a" / frame, shape(0.0))
    refused(twins, r"one ending, got 2 .obj \(f_0.obj\) and 2 .ply \(f_0.ply\)")


def test_what_systems_leave_behind_is_no_frame(tmp_path: Path) -> None:
    root = folder(tmp_path / "src", ["f_0.obj", "f_1.obj", "f_2.obj"], [0.0, 0.1, 0.2])
    for name in ("._f_0.obj", ".DS_Store", "Thumbs.db", "desktop.ini", "f_0.mtl", "notes.txt", "f_3.obj.part"):
        (root / "a" / name).write_bytes(b"\0\1")
    (root / "__MACOSX").mkdir()
    (root / ".git").mkdir()
    (root / "a/textures").mkdir()
    dataset, sequence = imported(root)
    assert len(sequence.times) == 3
    assert "notes" not in dataset.provenance


def test_what_is_left_out_is_said(tmp_path: Path) -> None:
    root = folder(tmp_path / "src", ["f_0.obj", "f_1.obj"], [0.0, 0.1])
    (root / "c").mkdir()
    dataset, _ = imported(root)
    assert dataset.provenance["notes"][0].endswith("without a row in the table, and left out: c")


@pytest.mark.parametrize(
    ("files", "message"),
    [
        (["f_0.abc"], "found 1 .abc: .abc is not read: export .obj or .ply frames"),
        (["f_0.usd", "f_1.usd"], "found 2 .usd: .usd is not read"),
        (["x.bvh"], "of motion capture, .c3d is read"),
        (["f.0001.bgeo"], "let Houdini write .obj frames"),
        (["f_0.pvtu"], "save one .vtu or .vtp for each frame"),
        (["f_0.glb"], "keep the order of vertices"),
        (["readme.txt"], "found 1 .txt"),
        ([], "found none"),
        (["inner/f_0.obj"], "found folders inner"),
        (["f_0.obj", "f_1.obj", "old/f_0.obj"], "in its folder old"),
    ],
)
def test_folders_without_frames_say_what_they_have(files: list[str], message: str, tmp_path: Path) -> None:
    root = folder(tmp_path / "src", [], [])
    for file in files:
        path = root / "a" / file
        path.parent.mkdir(exist_ok=True)
        obj(path, shape(0.0))
    refused(root, f"src/a: expected .*{message}")


def test_formats_of_whole_sequences_are_named(tmp_path: Path) -> None:
    root = tmp_path / "src"
    root.mkdir()
    (root / "parameters.csv").write_text(TABLE)
    (root / "a.abc").touch()
    refused(root, "sequence 'a': no such folder or file .*: .abc is not read: export .obj or .ply frames")
    (root / "parameters.csv").rename(root / "parameters.xlsx")
    refused(root, "expected parameters.csv or parameters.json, got parameters.xlsx: save it as CSV")
    (root / "parameters.csv").write_text(TABLE)
    (root / "parameters.json").write_text("[]")
    refused(root, "expected one table, got parameters.csv and parameters.json")
    (tmp_path / "x.fbx").touch()
    with pytest.raises(InputError, match=r"expected a folder or a zip archive, got a file: .fbx is not read"):
        import_dataset(tmp_path / "x.fbx", tmp_path / "out")


@pytest.mark.parametrize(("unit", "size"), [("m", 100.0), ("mm", 0.1)])
def test_the_size_of_a_body_is_said(unit: str, size: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def large(path: Path, points: np.ndarray) -> None:
        obj(path, 1000.0 * points)

    root = folder(tmp_path / "src", ["f_0.obj", "f_1.obj"], [0.0, 0.1], large)
    assert main(["import", str(root), "--out", str(tmp_path / "out"), "--unit", unit]) == 0
    printed = capsys.readouterr()
    assert f"a body of {size:g} m, 10 frames per second for 0.1 s" in printed.out
    assert ("note: the body of a is 100 m large" in printed.err) == (unit == "m")
    assert ("with --unit mm it would be 0.1 m" in printed.err) == (unit == "m")
    assert main(["import", str(root), "--out", str(tmp_path / "out"), "--unit", "parsec"]) == 2


def test_triangles_of_stl_share_the_vertices_that_stay_together(tmp_path: Path) -> None:
    root = folder(tmp_path / "src", ["f_0.stl", "f_1.stl", "f_2.stl"], [0.0, 0.1, 0.2], stl)
    _, sequence = imported(root)
    assert sequence.vertices.shape == (3, 4, 3)
    lifted = trimesh.Trimesh(sequence.vertices[2], sequence.faces, process=False)
    assert lifted.is_watertight
    assert np.allclose(sorted(map(tuple, sequence.vertices[1].tolist())), sorted(map(tuple, shape(0.1).tolist())))
    other = trimesh.Trimesh(shape(0.2), TETRAHEDRON[::-1], process=False)
    other.export(root / "a/f_2.stl")
    other.export(root / "b/f_2.stl")
    refused_all(root, "a/f_2.stl: expected the triangles of f_0.stl in their order")
    trimesh.Trimesh(shape(0.2), TETRAHEDRON[:3], process=False).export(root / "a/f_2.stl")
    refused_all(root, "expected the same mesh as in f_0.stl, of 12 vertices and 4 faces, got 9 and 3")


def test_parts_that_touch_at_first_come_apart(tmp_path: Path) -> None:
    """Two boxes of twelve triangles: their common corners are vertices of both."""
    box = trimesh.creation.box(extents=(0.1, 0.1, 0.1)).subdivide().subdivide()

    def pair(path: Path, points: np.ndarray) -> None:
        other = box.copy().apply_translation([0.1, 0.1, 0.1 + points[0, 2]])
        trimesh.util.concatenate([box, other]).export(path)

    _, sequence = imported(folder(tmp_path / "src", ["f_0.stl", "f_1.stl", "f_2.stl"], [0.0, 0.1, 0.2], pair))
    assert sequence.vertices.shape[1] == 2 * len(box.vertices)


def test_nothing_moves_is_said(tmp_path: Path) -> None:
    dataset, _ = imported(folder(tmp_path / "src", ["f_0.obj", "f_1.obj"], [0.2, 0.2]))
    assert dataset.provenance["notes"][0] == "a: nothing moves: all 2 frames are the same"


TABLES = {
    "square brackets": "sequence,mass [kg],rate\na,0.5,10\nb,0.8,10\n",
    "rate with its unit": "sequence,mass (kg),rate (Hz)\na,0.5,10\nb,0.8,10\n",
    "German": "Sequence;mass (kg);Rate [Hz]\na;0,5;10,0\nb;0,8;10,0\n",
    "another order": "rate;mass [kg];sequence;split\n10;0,5;a;Train\n10;0,8;b;TEST\n",
}


@pytest.mark.parametrize("name", TABLES)
def test_columns_mean_the_same(name: str, tmp_path: Path) -> None:
    dataset, sequence = imported(folder(tmp_path / "src", ["f_0.obj", "f_1.obj"], [0.0, 0.1], table=TABLES[name]))
    (mass,) = dataset.schema.parameters
    assert (mass.name, mass.unit, mass.low, mass.high) == ("mass", "kg", 0.5, 0.8)
    assert dataset.schema.window.rate == 10.0
    assert sequence.parameters == {"mass": 0.5}


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("sequence,mass,rate (kHz)\na,1,1\nb,2,1\n", r"column 'rate \(kHz\)': expected a rate in Hz"),
        ("sequence,mass (kg),mass (g),rate\na,1,1,9\nb,2,1,9\n", "two columns of the parameter 'mass'"),
        ("sequence,(kg),rate\na,1,10\nb,2,10\n", r"column '\(kg\)' has a unit, but no name"),
        ("sequence,mass,rate\n,kg,Hz\na,1,10\nb,2,10\n", "line 2: expected the name of a sequence"),
        ("sequence,mass,rate\na,1,10\nb,,10\n", "line 3: b: mass: expected a number, got ''"),
        ("sequence,mass,rate\na,1,10\nb,2,20\n", "expected one rate in Hz, .*got 10, 20"),
    ],
)
def test_other_columns_are_refused(table: str, message: str, tmp_path: Path) -> None:
    refused(folder(tmp_path / "src", ["f_0.obj", "f_1.obj"], [0.0, 0.1], table=table), message)


def test_names_of_folders_in_other_forms_of_unicode(tmp_path: Path) -> None:
    root = folder(tmp_path / "src", ["f_0.obj", "f_1.obj"], [0.0, 0.1], table=TABLE.replace("\na", "\nw\u00fcrfel"))
    (root / "a").rename(root / "wu\u0308rfel")
    dataset = import_dataset(root, tmp_path / "out")
    assert {entry.status for entry in dataset.entries} == {"ok"}
