"""Volume meshes of VTK and Gmsh: their surface is read."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from fuzz.scans import CUBE, msh_bytes, vtk_bytes, vtu_bytes

from odeform.errors import InputError
from odeform.formats.reading import read_geometry
from odeform.types import Mesh, PointCloud

FIVE = [[0, 1, 3, 4], [1, 2, 3, 6], [1, 4, 5, 6], [3, 4, 6, 7], [1, 3, 4, 6]]
"""Tetrahedra that fill the unit cube."""
TOP = np.array([[0.5, 0.5, 2.0]])
FORMS = ("ascii", "binary", "zlib", "appended")


def _read(path: Path, content: bytes, merge: bool = True) -> Mesh:
    path.write_bytes(content)
    mesh = read_geometry(path, merge)
    assert isinstance(mesh, Mesh)
    return mesh


def _volume(mesh: Mesh) -> float:
    made = trimesh.Trimesh(mesh.points, mesh.faces, process=False)
    assert made.is_watertight
    assert made.is_winding_consistent
    return float(made.volume)


CELLS = {
    "tetrahedra": ([*CUBE], FIVE, [10] * 5, 1.0),
    "hexahedron": ([*CUBE], [list(range(8))], [12], 1.0),
    "voxel": (CUBE[[0, 1, 3, 2, 4, 5, 7, 6]], [list(range(8))], [11], 1.0),
    "hexahedron and pyramid": ([*CUBE, *TOP], [list(range(8)), [4, 5, 6, 7, 8]], [12, 14], 1.0 + 1.0 / 3.0),
    "wedges": ([*CUBE], [[0, 1, 2, 4, 5, 6], [0, 3, 2, 4, 7, 6]], [13, 13], 1.0),
    "inside out": ([*CUBE], [[1, 0, 3, 4]], [10], 1.0 / 6.0),
    "quadratic tetrahedron": ([*CUBE, *np.zeros((6, 3))], [[0, 1, 3, 4, 8, 9, 10, 11, 12, 13]], [24], 1.0 / 6.0),
}


@pytest.mark.parametrize("kind", CELLS)
def test_the_surface_of_solid_cells(tmp_path: Path, kind: str) -> None:
    points, cells, types, volume = CELLS[kind]
    files = {
        "a.vtk": vtk_bytes(np.array(points), cells, types),
        "b.vtk": vtk_bytes(np.array(points), cells, types, True),
    }
    files |= {f"{form}.vtu": vtu_bytes(np.array(points), cells, types, form) for form in FORMS}
    for name, content in files.items():
        assert _volume(_read(tmp_path / name, content)) == pytest.approx(volume), name


def test_without_merging_the_nodes_stay_in_their_order(tmp_path: Path) -> None:
    points = np.concatenate([CUBE, [[0.5, 0.5, 0.5]], CUBE[:1]])
    mesh = _read(tmp_path / "a.vtk", vtk_bytes(points, FIVE, [10] * 5), merge=False)
    np.testing.assert_array_equal(mesh.points, points)
    assert mesh.faces.max() < 8


def test_faces_beside_solid_cells_and_lines_are_noted(tmp_path: Path) -> None:
    cells, types = [*FIVE, [0, 1, 2], [0, 1]], [*[10] * 5, 5, 3]
    mesh = _read(tmp_path / "a.vtk", vtk_bytes(CUBE, cells, types))
    assert _volume(mesh) == pytest.approx(1.0)
    assert mesh.notes == (
        "1 cell, neither solid nor a face, left out",
        "1 face beside the solid cells left out",
    )


POLYDATA = "# vtk DataFile Version 3.0\nmade here\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0\n1 1 0 0 1 0\n"


def test_polygons_and_strips_of_legacy_files(tmp_path: Path) -> None:
    for text in ("POLYGONS 1 5\n4 0 1 2 3\n", "TRIANGLE_STRIPS 1 5\n4 0 1 3 2\n", "POLYGONS 2 8\n3 0 1 2\n3 0 2 3\n"):
        mesh = _read(tmp_path / "a.vtk", (POLYDATA + text).encode())
        a, b, c = mesh.points[mesh.faces].swapaxes(0, 1)
        np.testing.assert_allclose(np.cross(b - a, c - a).sum(axis=0), [0, 0, 2])
    (tmp_path / "b.vtk").write_text(POLYDATA)
    assert isinstance(read_geometry(tmp_path / "b.vtk"), PointCloud)


def test_polygons_of_xml(tmp_path: Path) -> None:
    text = (
        '<?xml version="1.0"?><VTKFile type="PolyData" byte_order="LittleEndian"><PolyData><Piece NumberOfPoints="4" '
        'NumberOfPolys="1"><Points>'
        '<DataArray type="Float32" format="ascii">0 0 0 1 0 0 1 1 0 0 1 0</DataArray></Points>'
        '<Polys><DataArray type="Int32" Name="connectivity" format="ascii">0 1 2 3</DataArray>'
        '<DataArray type="Int32" Name="offsets" format="ascii">4</DataArray></Polys></Piece></PolyData></VTKFile>'
    )
    assert len(_read(tmp_path / "a.vtp", text.encode()).faces) == 2
    for changed, said in (
        (text.replace("0 1 2 3<", "0 1 2 9<"), "a cell refers to vertex 9, of 4"),
        (text.replace("0 1 2 3<", "0 1 2<"), "expected offsets that increase up to 3"),
        (text[:-30], "not valid XML"),
        (text.replace("PolyData", "ImageData"), "ImageData"),
        (text.replace('byte_order="LittleEndian"', 'compressor="vtkLZ4DataCompressor"'), "vtkLZ4DataCompressor, which"),
    ):
        with pytest.raises(InputError, match=said):
            _read(tmp_path / "a.vtp", changed.encode())


@pytest.mark.parametrize("version", ["2.2", "4.1"])
@pytest.mark.parametrize("binary", [False, True])
def test_gmsh(tmp_path: Path, version: str, binary: bool) -> None:
    data = msh_bytes(CUBE, FIVE, version, binary)
    mesh = _read(tmp_path / "a.msh", data)
    assert len(mesh.points) == 8
    assert _volume(mesh) == pytest.approx(1.0)
    for cut in (data[:-30], data[: len(data) // 2], data[:20]):
        with pytest.raises(InputError, match=r"truncated|of version 2 or 4.1"):
            _read(tmp_path / "a.msh", cut)


def test_nodes_of_gmsh_with_numbers_of_their_own(tmp_path: Path) -> None:
    text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n10 0 0 0\n7 1 0 0\n3 0 1 0\n99 0 0 1\n$EndNodes\n"
    text += "$Elements\n2\n1 15 2 0 0 10\n2 4 2 0 0 10 7 3 99\n$EndElements\n"
    assert _volume(_read(tmp_path / "a.msh", text.encode())) == pytest.approx(1.0 / 6.0)
    with pytest.raises(InputError, match="refers to node 98, which does not exist"):
        _read(tmp_path / "a.msh", text.replace("3 99\n", "3 98\n").encode())
    with pytest.raises(InputError, match=r"of version 2 or 4\.1, got '4\.0 0 8'"):
        _read(tmp_path / "a.msh", text.replace("2.2 0", "4.0 0").encode())


@pytest.mark.parametrize("binary", [False, True])
def test_legacy_files_that_are_cut_short(tmp_path: Path, binary: bool) -> None:
    data = vtk_bytes(CUBE, FIVE, [10] * 5, binary)
    for stop in (data.index(b"POINTS") + 60, data.index(b"CELLS") + 20, data.index(b"CELL_TYPES")):
        with pytest.raises(InputError, match="truncated"):
            _read(tmp_path / "a.vtk", data[:stop])
