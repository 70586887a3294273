"""Motions as other programs leave them on disk: imported as they are meant, or refused in one line."""

import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from authors import TETRAHEDRON
from vtk_files import legacy, polydata, unstructured

from odeform.cli import main
from odeform.dataset.importers.registry import import_dataset
from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.types import MotionSequence

CORNERS = 0.1 * np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
TABLE = "sequence,mass (kg),rate\na,0.5,10\nb,0.8,10\n"
WITHOUT_RATE = "sequence,mass (kg)\na,0.5\nb,0.8\n"
Frame = Callable[[Path, np.ndarray], None]


def shape(height: float) -> np.ndarray:
    """A tetrahedron that is lifted and stretched."""
    return CORNERS * (1.0 + 0.1 * height) + [0.0, 0.0, height]


def obj(path: Path, points: np.ndarray) -> None:
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points]
    path.write_text("\n".join(lines + ["f " + " ".join(map(str, face)) for face in TETRAHEDRON + 1]))


def stl(path: Path, points: np.ndarray) -> None:
    trimesh.Trimesh(points, TETRAHEDRON, process=False).export(path)


def folder(root: Path, names: list[str], heights: list[float], write: Frame = obj, table: str = TABLE) -> Path:
    """Two sequences of the same frames, and a table."""
    for name in ("a", "b"):
        (root / name).mkdir(parents=True)
        for frame, height in zip(names, heights, strict=True):
            write(root / name / frame, shape(height))
    (root / "parameters.csv").write_text(table)
    return root


def imported(root: Path, rate: float | None = None, unit: str = "m") -> tuple[Dataset, MotionSequence]:
    dataset = import_dataset(root, root.parent / "out", rate, unit=unit)
    return dataset, next(sequence for sequence in dataset.sequences("all") if sequence.name == "a")


def heights(sequence: MotionSequence) -> list[float]:
    return [round(float(z), 4) for z in sequence.vertices[:, 0, 2]]


def refused(root: Path, message: str, rate: float | None = None) -> None:
    with pytest.raises(InputError, match=message):
        imported(root, rate)
    assert not (root.parent / "out/dataset.json").exists()


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
    with pytest.raises(InputError, match="a counts in steps of 0.0005: if these are seconds, --rate 2000"):
        imported(even)


def test_steps_in_the_numbers_are_said_and_the_same_in_all_sequences(tmp_path: Path) -> None:
    root = folder(tmp_path / "src", ["f_0.obj", "f_5.obj", "f_10.obj"], [0.0, 0.1, 0.2])
    dataset, sequence = imported(root)
    assert np.allclose(sequence.times, [0.0, 0.1, 0.2])
    assert "steps of 5; they are taken 0.1 s apart" in dataset.provenance["notes"][0]
    (root / "b/f_5.obj").rename(root / "b/f_1.obj")
    (root / "b/f_10.obj").rename(root / "b/f_2.obj")
    with pytest.raises(InputError, match="numbered as in a, in steps of 5, got steps of 1: .*are frames missing"):
        imported(root)


def test_a_table_of_times_is_the_clock(tmp_path: Path) -> None:
    root = folder(tmp_path / "src", ["x.obj", "f_1.obj", "f_2.obj", "f_7.obj"], [0.0, 0.1, 0.2, 0.7])
    for name in ("a", "b"):
        (root / name / "times.csv").write_text("file;time [ms]\nf_7.obj;700,0\nx;0,0\nf_2;200,0\nf_1.obj;100,0\n")
    dataset, sequence = imported(root)
    assert heights(sequence) == [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]
    assert "resampled from uneven times" in dataset.provenance["notes"][0]
    (root / "a/times.csv").write_text("file,time\nx,0\nf_1,0.1\n")
    with pytest.raises(InputError, match="times.csv: expected a time for each frame, got none for f_2.obj"):
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
    with pytest.raises(InputError, match="expected a folder or a zip archive, got a file: .fbx is not read"):
        import_dataset(tmp_path / "x.fbx", tmp_path / "out")


@pytest.mark.parametrize(("unit", "size"), [("m", 100.0), ("mm", 0.1)])
def test_the_size_of_a_body_is_said(unit: str, size: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    large: Frame = lambda path, points: obj(path, 1000.0 * points)
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
    refused_all(root, "expected the same mesh as in f_0.stl, of 12 vertices and 4 faces, got 9 and 3", first=True)


def refused_all(root: Path, message: str, first: bool = False) -> None:
    """The sequence a is listed with the message; if b is refused too, so is everything."""
    with pytest.raises(InputError, match=f"none of 2 sequences can be read; .*{message}"):
        imported(root)


def test_parts_that_touch_at_first_come_apart(tmp_path: Path) -> None:
    """Two boxes of twelve triangles: their common corners are vertices of both."""
    box = trimesh.creation.box(extents=(0.1, 0.1, 0.1)).subdivide().subdivide()

    def pair(path: Path, points: np.ndarray) -> None:
        other = box.copy().apply_translation([0.1, 0.1, 0.1 + points[0, 2]])
        trimesh.util.concatenate([box, other]).export(path)

    _, sequence = imported(folder(tmp_path / "src", ["f_0.stl", "f_1.stl", "f_2.stl"], [0.0, 0.1, 0.2], pair))
    assert sequence.vertices.shape[1] == 2 * len(box.vertices)


VTK_FRAMES: dict[str, tuple[str, Callable[[np.ndarray], bytes]]] = {
    "legacy text": ("f_{}.vtk", lambda points: legacy(points, TETRAHEDRON)),
    "legacy binary": ("f_{}.vtk", lambda points: legacy(points, TETRAHEDRON, binary=True)),
    "polygons": ("f_{}.vtp", lambda points: polydata(points, TETRAHEDRON, "raw")),
    "volume": ("f_{}.vtu", lambda points: unstructured(points, [[0, 1, 2, 3]], 10, form="zlib")),
    "displaced": (
        "f_{}.vtu",
        lambda points: unstructured(CORNERS, [[0, 1, 2, 3]], 10, {"DISPLACEMENT": points - CORNERS, "V": points}),
    ),
}


@pytest.mark.parametrize("name", VTK_FRAMES)
def test_frames_of_vtk(name: str, tmp_path: Path) -> None:
    ending, data = VTK_FRAMES[name]
    names = [ending.format(number) for number in (8, 9, 10)]
    write: Frame = lambda path, points: path.write_bytes(data(points)) and None
    dataset, sequence = imported(folder(tmp_path / "src", names, [0.0, 0.1, 0.2], write))
    assert heights(sequence) == [0.0, 0.1, 0.2]
    assert np.allclose(sequence.vertices[2], shape(0.2), atol=1e-6)
    assert len(sequence.faces) == 4
    assert ("notes" in dataset.provenance) == (name == "displaced")


@pytest.mark.parametrize("kind", ["pvd", "series"])
def test_lists_of_paraview_have_the_times(kind: str, tmp_path: Path) -> None:
    """Files in a folder beside the list, which is not in the order of the times."""
    root = tmp_path / "src"
    for name in ("a", "b"):
        (root / f"{name}").mkdir(parents=True)
        times = [0.5, 0.0, 0.25, 0.75]
        files = [f"{name}/{name}_{k}.vtp" for k in range(4)]
        for file, time in zip(files, times, strict=True):
            (root / file).write_bytes(polydata(shape(time), TETRAHEDRON))
        if kind == "pvd":
            entries = "".join(
                f'<DataSet timestep="{t}" part="0" file="{file}"/>' for t, file in zip(times, files, strict=True)
            )
            text = f'<?xml version="1.0"?><VTKFile type="Collection"><Collection>{entries}</Collection></VTKFile>'
            (root / f"{name}.pvd").write_text(text)
        else:
            listed = [{"name": file, "time": t} for t, file in zip(times, files, strict=True)]
            (root / f"{name}.vtp.series").write_text(json.dumps({"file-series-version": "1.0", "files": listed}))
    (root / "parameters.csv").write_text(WITHOUT_RATE)
    dataset, sequence = imported(root)
    assert dataset.schema.window.rate == 4.0
    assert heights(sequence) == [0.0, 0.25, 0.5, 0.75]
    dataset, sequence = imported(root, rate=8.0)
    assert heights(sequence) == [0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75]
    assert "resampled from 4 Hz to 8 Hz" in dataset.provenance["notes"][0]


def pvd(root: Path, entries: str) -> Path:
    root.mkdir()
    (root / "parameters.csv").write_text(TABLE)
    for name in ("a", "b"):
        (root / f"{name}.pvd").write_text(f'<VTKFile type="Collection"><Collection>{entries}</Collection></VTKFile>')
    return root


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ("", "at least 2 frames, got 0"),
        ('<DataSet timestep="0" file="../x.vtp"/><DataSet timestep="1" file="y.vtp"/>', "below its folder, got ../x"),
        ('<DataSet timestep="0" file="/etc/x.vtp"/><DataSet timestep="1" file="y.vtp"/>', "below its folder"),
        ('<DataSet timestep="0" file="x.vtp"/><DataSet timestep="1" file="y.vtp"/>', "no file x.vtp"),
        ('<DataSet timestep="0" file="x.pvtu"/><DataSet timestep="1" file="y.pvtu"/>', "files that end in .vtk"),
        ('<DataSet timestep="0" file="x.vtp"/><DataSet timestep="0" file="y.vtp"/>', "one file for each time"),
        ('<DataSet timestep="0" file="x.vtp"/><DataSet timestep="0" part="1" file="y.vtp"/>', "one part at each time"),
        ('<DataSet timestep="soon" file="x.vtp"/><DataSet timestep="1" file="y.vtp"/>', "a time .*got 'soon'"),
    ],
)
def test_other_lists_are_refused(entries: str, message: str, tmp_path: Path) -> None:
    refused(pvd(tmp_path / "src", entries), f"a.pvd: .*{message}")


def test_integer_times_count_frames_where_a_rate_is_given(tmp_path: Path) -> None:
    entries = "".join(f'<DataSet timestep="{k}" file="f{k}.vtp"/>' for k in range(3))
    root = pvd(tmp_path / "src", entries)
    for k in range(3):
        (root / f"f{k}.vtp").write_bytes(polydata(shape(0.1 * k), TETRAHEDRON))
    dataset, sequence = imported(root)
    assert heights(sequence) == [0.0, 0.1, 0.2]
    assert "integers; they are taken to count frames, 0.1 s apart" in dataset.provenance["notes"][0]


def test_fields_of_displacements_in_one_file(tmp_path: Path) -> None:
    root = tmp_path / "src"
    root.mkdir()
    fields = {f"displacement{k}": shape(0.1 * k) - CORNERS for k in (10, 9, 8)}
    for name in ("a", "b"):
        (root / f"{name}.vtk").write_bytes(legacy(CORNERS, TETRAHEDRON, {**fields, "velocity1": CORNERS}))
    (root / "parameters.csv").write_text(TABLE)
    _, sequence = imported(root)
    assert heights(sequence) == [0.8, 0.9, 1.0]
    (root / "a.vtk").write_bytes(legacy(CORNERS, TETRAHEDRON, {"displacement0": CORNERS, "displacement2": CORNERS}))
    with pytest.raises(InputError, match="a.vtk: field 1 is missing between displacement0 and displacement2"):
        imported(root)


@pytest.mark.parametrize("names", [("times", "vertices"), ("t", "positions"), ("time", "points")])
def test_arrays_of_vertices(names: tuple[str, str], tmp_path: Path) -> None:
    root = tmp_path / "src"
    root.mkdir()
    frames = np.stack([shape(0.1 * k) for k in range(5)])
    for name in ("a", "b"):
        np.savez(root / f"{name}.npz", **{names[0]: 3.0 + 0.02 * np.arange(5), names[1]: frames, "faces": TETRAHEDRON})
    (root / "parameters.csv").write_text(WITHOUT_RATE)
    dataset, sequence = imported(root)
    assert dataset.schema.window.rate == 50.0
    assert np.allclose(sequence.times, 0.02 * np.arange(5))
    assert np.allclose(sequence.vertices, frames)
    assert np.array_equal(sequence.faces, TETRAHEDRON)
    dataset, sequence = imported(root, rate=25.0)
    assert heights(sequence) == [0.0, 0.2, 0.4]


def test_points_without_faces_are_a_body_too(tmp_path: Path) -> None:
    root = tmp_path / "src"
    root.mkdir()
    for name in ("a", "b"):
        np.savez(root / f"{name}.npz", times=0.1 * np.arange(3), positions=np.stack([shape(0.1 * k) for k in range(3)]))
    (root / "parameters.csv").write_text(WITHOUT_RATE)
    _, sequence = imported(root)
    assert sequence.faces.shape == (0, 3)
    assert np.allclose(sequence.weights, 0.25)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"x": np.zeros(3)}, r"expected an array vertices \(T, N, 3\), got x"),
        ({"vertices": np.zeros((4, 3))}, r"expected vertices \(T, N, 3\) of numbers, got float64 \(4, 3\)"),
        ({"vertices": np.zeros((4, 4, 3)), "times": np.zeros(3)}, r"expected times \(4,\), one for each frame"),
        ({"vertices": np.zeros((4, 4, 3)), "times": np.zeros(4)}, "times that increase"),
        ({"points": np.zeros((4, 4, 3)), "verts": np.zeros((4, 4, 3))}, "one array vertices, got points and verts"),
        ({"vertices": np.array([None])}, "Python objects, which are not read"),
        ({"vertices": np.zeros((4, 4, 3)), "faces": np.full((1, 3), 7), "t": np.arange(4.0)}, "vertices that do not"),
    ],
)
def test_other_arrays_are_refused(arrays: dict[str, np.ndarray], message: str, tmp_path: Path) -> None:
    root = tmp_path / "src"
    root.mkdir()
    for name in ("a", "b"):
        np.savez(root / f"{name}.npz", **arrays)  # pyright: ignore[reportArgumentType]
    (root / "parameters.csv").write_text(TABLE)
    refused(root, f"a.npz: .*{message}")


def test_a_name_means_one_sequence(tmp_path: Path) -> None:
    root = folder(tmp_path / "src", ["f_0.obj", "f_1.obj"], [0.0, 0.1])
    np.savez(root / "a.npz", times=np.arange(2.0), vertices=np.zeros((2, 4, 3)))
    refused(root, "line 2: expected one a, got a and a.npz")
    (root / "parameters.csv").write_text(TABLE + "a.npz,1.0,10\n")
    (root / "a").rename(root / "c")
    refused(root, "each sequence only once")


def test_nothing_moves_is_said(tmp_path: Path) -> None:
    dataset, _ = imported(folder(tmp_path / "src", ["f_0.obj", "f_1.obj"], [0.2, 0.2]))
    assert dataset.provenance["notes"][0] == "a: nothing moves: all 2 frames are the same"


def zipped(root: Path, below: str = "") -> Path:
    path = root.with_suffix(".zip")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(root.rglob("*")):
            archive.write(file, below + str(file.relative_to(root)))
    return path


@pytest.mark.parametrize("below", ["", "throws/"])
def test_zipped_folders(below: str, tmp_path: Path) -> None:
    path = zipped(folder(tmp_path / "src", ["f_0.obj", "f_1.obj", "f_2.obj"], [0.0, 0.1, 0.2]), below)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("__MACOSX/._a", b"x")
    dataset, sequence = imported(path)
    assert dataset.schema.scene == ("imported-throws" if below else "imported-src")
    assert heights(sequence) == [0.0, 0.1, 0.2]
    gap = zipped(folder(tmp_path / "gap", ["f_0.obj", "f_1.obj", "f_3.obj"], [0.0, 0.1, 0.3]))
    with pytest.raises(InputError, match=r"gap.zip/a: frame 2 is missing"):
        import_dataset(gap, tmp_path / "out")


def test_zipped_sequences(tmp_path: Path) -> None:
    root = folder(tmp_path / "src", ["f_0.obj", "f_1.obj", "f_2.obj"], [0.0, 0.1, 0.2])
    for name in ("a", "b"):
        zipped(root / name)
        for file in (root / name).iterdir():
            file.unlink()
        (root / name).rmdir()
    dataset, sequence = imported(root)
    assert heights(sequence) == [0.0, 0.1, 0.2]
    assert [entry.name for entry in dataset.entries] == ["a", "b"]


@pytest.mark.parametrize(
    ("names", "content", "message"),
    [
        (["../out.obj"], b"x", "paths inside the archive, got ../out.obj"),
        (["/etc/out.obj"], b"x", "paths inside the archive"),
        (["a\\..\\..\\out.obj"], b"x", "paths inside the archive"),
        (["C:/out.obj"], b"x", "paths inside the archive"),
        (["a/f_0.obj", "a//f_0.obj"], b"x", "is there twice"),
        (["bomb"], bytes(10_000_000), "at most .*times the archive"),
    ],
)
def test_archives_are_unpacked_in_their_folder_only(
    names: list[str], content: bytes, message: str, tmp_path: Path
) -> None:
    path = tmp_path / "x.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in names:
            archive.writestr(name, content)
    with pytest.raises(InputError, match=f"x.zip: .*{message}"):
        import_dataset(path, tmp_path / "out")


def test_links_in_archives_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.zip"
    link = zipfile.ZipInfo("a/f_0.obj")
    link.external_attr = 0o120777 << 16
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(link, "/etc/passwd")
    with pytest.raises(InputError, match="got the link a/f_0.obj"):
        import_dataset(path, tmp_path / "out")


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
