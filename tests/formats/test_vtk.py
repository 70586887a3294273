"""VTK's files: the surface of polygons, strips and volumes, in all encodings; damage is named."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from fuzz.vtk_files import legacy, polydata, unstructured

import odeform
from odeform.errors import InputError
from odeform.types import Mesh, PointCloud

BOX = trimesh.creation.box(extents=(1.0, 2.0, 3.0))
CUBE = np.array([[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], float)
SECOND = np.vstack([CUBE, CUBE[[1, 2, 5, 6]] + [1.0, 0.0, 0.0]])


def solid(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.points, mesh.faces, process=False)


def read(data: bytes, path: Path, merge: bool = False) -> Mesh:
    path.write_bytes(data)
    mesh = odeform.read_geometry(path, merge)
    assert isinstance(mesh, Mesh)
    return mesh


@pytest.mark.parametrize("binary", [False, True])
def test_legacy_polygons(binary: bool, tmp_path: Path) -> None:
    mesh = read(legacy(BOX.vertices, BOX.faces, {"velocity": BOX.vertices}, binary), tmp_path / "a.vtk")
    assert np.allclose(mesh.points, BOX.vertices)
    assert np.array_equal(mesh.faces, BOX.faces)


@pytest.mark.parametrize("form", ["ascii", "binary", "zlib", "lzma", "raw"])
def test_xml_in_all_encodings(form: str, tmp_path: Path) -> None:
    mesh = read(polydata(BOX.vertices, BOX.faces, form), tmp_path / "a.vtp")
    assert np.allclose(mesh.points, BOX.vertices)
    assert np.array_equal(mesh.faces, BOX.faces)
    inside = np.vstack([SECOND, [[9.0, 9.0, 9.0]]])
    cells = [[0, 1, 2, 3, 4, 5, 6, 7], [1, 8, 9, 2, 5, 10, 11, 6]]
    shell = solid(read(unstructured(inside, cells, 12, form=form), tmp_path / "a.vtu"))
    assert shell.is_watertight
    assert (len(shell.vertices), shell.volume) == (
        13,
        pytest.approx(2.0),
    )


def test_one_cell_in_base64(tmp_path: Path) -> None:
    """Its type is a single byte behind the four of the header, which are encoded together."""
    shell = solid(read(unstructured(CUBE, [list(range(8))], 12, form="binary"), tmp_path / "a.vtu"))
    assert shell.volume == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("kind", "corners", "volume"),
    [
        (10, [0, 1, 3, 4], 1 / 6),
        (11, [0, 1, 3, 2, 4, 5, 7, 6], 1.0),
        (12, range(8), 1.0),
        (13, [0, 3, 1, 4, 7, 5], 0.5),
        (14, [0, 1, 2, 3, 4], 1 / 3),
        (24, [0, 1, 3, 4, 5, 5, 5, 5, 5, 5], 1 / 6),
        (71, [0, 1, 3, 4, 5, 5, 5, 5, 5, 5], 1 / 6),
    ],
)
def test_volumes_are_turned_outside(kind: int, corners: list[int], volume: float, tmp_path: Path) -> None:
    shell = solid(read(unstructured(CUBE, [list(corners)], kind), tmp_path / "a.vtu"))
    assert abs(shell.volume) == pytest.approx(volume)
    assert kind == 13 or shell.volume > 0.0


def test_version_5_and_strips_and_blocks_of_metadata(tmp_path: Path) -> None:
    text = (
        "# vtk DataFile Version 5.1\ntitle\nASCII\nDATASET POLYDATA\nPOINTS 4 double\n0 0 0 1 0 0 0 1 0 1 1 0\n\n"
        "METADATA\nINFORMATION 1\nNAME x LOCATION y\nDATA 2 0 1\n\n"
        "TRIANGLE_STRIPS 2 4\nOFFSETS vtktypeint64\n0 4\nCONNECTIVITY vtktypeint64\n0 1 2 3\n"
        "POINT_DATA 4\nSCALARS s float 1\nLOOKUP_TABLE default\n1 2 3 4\nFIELD FieldData 1\nu 3 4 float\n" + "1 " * 12
    )
    mesh = read(text.encode(), tmp_path / "a.vtk")
    assert solid(mesh).area == pytest.approx(1.0)
    assert np.allclose(solid(mesh).face_normals, [0.0, 0.0, 1.0])


def test_vertices_that_coincide_become_one_unless_they_are_kept(tmp_path: Path) -> None:
    corners = BOX.vertices[BOX.faces].reshape(-1, 3)
    data = polydata(corners, np.arange(36).reshape(-1, 3))
    assert len(read(data, tmp_path / "a.vtp").points) == 36
    merged = solid(read(data, tmp_path / "a.vtp", merge=True))
    assert (len(merged.vertices), merged.is_watertight, merged.volume) == (8, True, pytest.approx(6.0))


def test_points_without_cells_are_a_cloud(tmp_path: Path) -> None:
    path = tmp_path / "a.vtk"
    path.write_text("# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 2 float\n0 0 0 1 1 1\n")
    assert isinstance(odeform.read_geometry(path), PointCloud)


HEAD = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET "
CELLS = "UNSTRUCTURED_GRID\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\nCELLS 1 4\n3 0 1 2\n"
REFUSED = {
    "another file": ("a.vtk", b"solid\n", "'# vtk DataFile' in the first line, got 'solid'"),
    "an image": ("a.vtk", (HEAD + "STRUCTURED_POINTS\n").encode(), "STRUCTURED_POINTS has no mesh"),
    "truncated text": ("a.vtk", (HEAD + "POLYDATA\nPOINTS 4 float\n1 2 3").encode(), "expected 12 numbers, got 3"),
    "truncated bytes": (
        "a.vtk",
        legacy(BOX.vertices, BOX.faces, binary=True)[:200],
        "bytes of .*truncated",
    ),
    "truncated before the types": ("a.vtk", (HEAD + CELLS).encode(), "expected CELL_TYPES behind CELLS"),
    "a word": ("a.vtk", (HEAD + "POLYDATA\nPOINTS 1 float\n1 2 x").encode(), "expected numbers, got 'x'"),
    "a keyword": ("a.vtk", (HEAD + "POLYDATA\nPOINTZ 1 float\n").encode(), "a keyword of VTK .* got 'POINTZ'"),
    "an immense number": ("a.vtk", (HEAD + "POLYDATA\nPOINTS 99999999999 float\n").encode(), "at most .*got '999"),
    "a point that is not there": ("a.vtk", legacy(CUBE, [[0, 1, 99]]), "a cell refers to vertex 99, of 8"),
    "polyhedra": ("a.vtu", unstructured(CUBE, [[0, 1, 2, 3]], 42), "polyhedra are not read: split them"),
    "a compressor": ("a.vtp", polydata(CUBE, [[0, 1, 2]], "zlib").replace(b"ZLib", b"LZ4"), "vtkLZ4.* ZLib, or none"),
    "an image in XML": ("a.vtu", b'<VTKFile type="ImageData"/>', "UnstructuredGrid or PolyData, got ImageData"),
    "broken XML": ("a.vtu", b"<VTKFile", "not valid XML"),
    "entities": ("a.vtu", b'<!DOCTYPE x [<!ENTITY y "z">]><VTKFile/>', "without a document type"),
    "truncated arrays": ("a.vtp", polydata(BOX.vertices, BOX.faces, "raw")[:-300], "array .*truncated"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_damage_is_named(name: str, tmp_path: Path) -> None:
    file, data, message = REFUSED[name]
    (tmp_path / file).write_bytes(data)
    with pytest.raises(InputError, match=message):
        odeform.read_geometry(tmp_path / file)
