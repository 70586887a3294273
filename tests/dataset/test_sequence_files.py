"""Sequences in one file, in a list or in an archive: imported as they are meant, or refused in one line."""

import json
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from authors import TETRAHEDRON
from fuzz.vtk_files import legacy, polydata, unstructured
from user_sequences import (
    CORNERS,
    TABLE,
    WITHOUT_RATE,
    folder,
    heights,
    imported,
    refused,
    shape,
)

from odeform.dataset.importers.registry import import_dataset
from odeform.errors import InputError

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

    def write(path: Path, points: np.ndarray) -> None:
        path.write_bytes(data(points))

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


def test_a_list_among_the_frames_says_their_times(tmp_path: Path) -> None:
    root = tmp_path / "src"
    for name in ("a", "b"):
        (root / name).mkdir(parents=True)
        entries = ""
        for k in range(3):
            (root / name / f"f_{k}.vtp").write_bytes(polydata(shape(0.1 * k), TETRAHEDRON))
            entries += f'<DataSet timestep="{0.5 * k}" file="f_{k}.vtp"/>'
        (root / name / "all.pvd").write_text(f'<VTKFile type="Collection"><Collection>{entries}</Collection></VTKFile>')
    (root / "parameters.csv").write_text(WITHOUT_RATE)
    dataset, sequence = imported(root)
    assert dataset.schema.window.rate == 2.0
    assert heights(sequence) == [0.0, 0.1, 0.2]
    (root / "a/more.pvd").touch()
    with pytest.raises(InputError, match=r"expected one sequence, got the lists all.pvd and more.pvd"):
        imported(root)


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
    (root / "a.vtk").write_bytes(legacy(CORNERS, TETRAHEDRON, {f"displacement{k}": CORNERS for k in (0, 1, 3)}))
    with pytest.raises(InputError, match=r"a.vtk: frame 2 is missing between displacement1 and displacement3"):
        imported(root)
    (root / "a.vtk").write_bytes(legacy(CORNERS, TETRAHEDRON[:, :2], {f"displacement{k}": CORNERS for k in range(3)}))
    dataset = import_dataset(root, tmp_path / "edges")
    assert "expected cells of at least three corners, got none" in dataset.entries[0].status
    (root / "a.vtk").write_bytes(legacy(CORNERS, TETRAHEDRON, {"displacement0": CORNERS}))
    with pytest.raises(InputError, match=r"a: expected at least 2 frames, got 1"):
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


def test_times_that_are_hardly_seconds_are_doubted(tmp_path: Path) -> None:
    root = tmp_path / "src"
    root.mkdir()
    for name in ("a", "b"):
        np.savez(root / f"{name}.npz", t=20.0 * np.arange(3), vertices=np.stack([shape(0.1 * k) for k in range(3)]))
    (root / "parameters.csv").write_text(WITHOUT_RATE)
    dataset, _ = imported(root)
    assert dataset.provenance["notes"] == ["the times make 0.05 frames per second: are they in seconds?"]


def test_points_without_faces_are_a_body_too(tmp_path: Path) -> None:
    root = tmp_path / "src"
    root.mkdir()
    for name in ("a", "b"):
        positions = np.stack([shape(0.1 * k) for k in range(3)])
        np.savez(root / f"{name}.npz", times=0.1 * np.arange(3), positions=positions, labels=np.array(["Tip"]))
    (root / "parameters.csv").write_text(WITHOUT_RATE)
    dataset, sequence = imported(root)
    assert dataset.provenance["notes"] == ["a and 1 more: arrays left out: labels"]
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


def test_archives_with_a_password_or_too_many_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a/f_0.obj", b"x")
    data = bytearray(path.read_bytes())
    directory = data.index(b"PK\x01\x02")
    for flags in (6, directory + 8):  # of the file itself, and of the directory
        data[flags] |= 1
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"a/f_0.obj has a password: unpack it yourself"):
        import_dataset(path, tmp_path / "out")
    entry = bytes(data[directory : data.index(b"PK\x05\x06")])
    count = 200_001
    end = struct.pack("<IHHHHIIH", 0x06054B50, 0, 0, 0xFFFF, 0xFFFF, 0xFFFFFFFF, 0xFFFFFFFF, 0)
    start = directory + count * len(entry)
    more = struct.pack("<IQHHIIQQQQ", 0x06064B50, 44, 45, 45, 0, 0, count, count, count * len(entry), directory)
    locator = struct.pack("<IIQI", 0x07064B50, 0, start, 1)
    path.write_bytes(bytes(data[:directory]) + entry * count + more + locator + end)
    with pytest.raises(InputError, match=r"expected at most 200,000 files, got 200,001"):
        import_dataset(path, tmp_path / "out")


def test_links_in_archives_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.zip"
    link = zipfile.ZipInfo("a/f_0.obj")
    link.external_attr = 0o120777 << 16
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(link, "/etc/passwd")
    with pytest.raises(InputError, match=r"got the link a/f_0.obj"):
        import_dataset(path, tmp_path / "out")
