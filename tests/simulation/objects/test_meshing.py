"""From signed distances and foreign meshes to solids."""

import sys

import numpy as np
import pytest
import trimesh
from odeform.simulation.objects.level_set import surface_of
from odeform.simulation.objects.remesh import remesh
from odeform.simulation.objects.repair import even_surface, repaired
from odeform.simulation.objects.tetrahedra import boundary, tetrahedralise

from odeform.errors import InputError
from odeform.simulation.errors import SimulationError
from odeform.simulation.objects.canonical import most_like, plausible_scale
from odeform.simulation.objects.catalog import get_object
from odeform.simulation.objects.files import arrays_of, read_object
from odeform.simulation.objects.from_mesh import placed_object
from odeform.simulation.objects.settling import settle
from odeform.simulation.objects.thickness import thicknesses
from odeform.types import Mesh, Perpoint, Points


def ball(points: Points) -> Perpoint:
    return np.linalg.norm(points - [0.01, 0.02, 0.03], axis=1) - 0.05


def mesh_of(shape: trimesh.Trimesh) -> Mesh:
    return Mesh(np.asarray(shape.vertices, dtype=float), np.asarray(shape.faces, dtype=np.int32))


def shape_of(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.points, mesh.faces, process=False)


def test_a_level_set_is_closed_and_lies_on_the_surface():
    pytest.importorskip("manifold3d")
    mesh = surface_of(ball, 0.008)
    assert shape_of(mesh).is_watertight
    assert shape_of(mesh).volume == pytest.approx(4 / 3 * np.pi * 0.05**3, rel=0.05)
    assert np.abs(ball(mesh.points)).max() < 1e-3


def test_remeshing_makes_even_triangles():
    fine = trimesh.creation.icosphere(4, 0.05)
    even = shape_of(remesh(mesh_of(fine), 200))
    lengths = even.edges_unique_length
    assert even.is_watertight
    assert len(even.vertices) == 200
    assert lengths.std() < 0.2 * lengths.mean()


def test_tetrahedra_fill_the_solid_with_its_surface_first():
    pytest.importorskip("pytetwild")
    fine = mesh_of(trimesh.creation.icosphere(2, 0.05))
    points, elements, faces = tetrahedralise(fine, 0.02)
    corners = points[elements]
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1]).sum() / 6.0
    assert volume == pytest.approx(shape_of(fine).volume, rel=0.02)
    assert set(np.unique(faces)) == set(range(faces.max() + 1))
    assert shape_of(Mesh(points, faces)).volume == pytest.approx(volume)


def test_the_boundary_of_one_tetrahedron_faces_outward():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    assert shape_of(Mesh(corners, boundary(np.array([[0, 1, 2, 3]])))).volume == pytest.approx(1.0 / 6.0)


def test_the_thickness_of_a_ball_is_its_diameter():
    assert thicknesses(mesh_of(trimesh.creation.icosphere(3, 0.05))) == pytest.approx(0.1, rel=0.02)


def test_a_file_returns_what_was_written(tmp_path):
    item = get_object("donut")
    np.savez_compressed(tmp_path / "copy.npz", **arrays_of(item))
    copy = read_object(tmp_path / "copy.npz")
    assert (copy.name, copy.material, copy.forces) == (item.name, item.material, item.forces)
    np.testing.assert_array_equal(copy.elements, item.elements)
    np.testing.assert_array_equal(copy.settled, item.settled)


def test_a_broken_file_is_refused(tmp_path):
    (tmp_path / "broken.npz").write_bytes(b"no zip")
    with pytest.raises(InputError, match=r"broken\.npz: cannot be read"):
        read_object(tmp_path / "broken.npz")


@pytest.mark.parametrize("name", ["bottle", "dog", "pillow"])
def test_a_turned_object_is_recognised(name: str):
    points = get_object(name).rest_mesh().points
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    found, rotation = most_like(300.0 * points @ turn.T + 5.0, None, "+z")
    assert found == name
    if name == "dog":  # the others are symmetric
        np.testing.assert_allclose(rotation, turn.T, atol=1e-9)


@pytest.mark.parametrize(("extent", "metres"), [(0.2, 0.2), (200.0, 0.2), (20.0, 0.2), (4e5, 0.16)])
def test_units_are_guessed(extent: float, metres: float):
    assert extent * plausible_scale(extent, "donut") == pytest.approx(metres, rel=0.01)


def test_a_missing_library_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "manifold3d", None)
    with pytest.raises(InputError, match=r"meshing needs manifold3d.*odeform\[objects\]"):
        surface_of(ball, 0.02)


def sheet() -> trimesh.Trimesh:
    x, y = np.meshgrid(np.linspace(0, 1, 8), np.linspace(0, 1, 8))
    plane = np.stack([x.ravel(), y.ravel(), 0.1 * np.sin(3 * x.ravel())], axis=1)
    quads = np.array([[i, i + 1, i + 9, i + 8] for i in range(56) if i % 8 != 7])
    return trimesh.Trimesh(plane, np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]), process=False)


def flat() -> trimesh.Trimesh:
    shape = trimesh.creation.icosphere(1, 0.05)
    return trimesh.Trimesh(shape.vertices * [1.0, 1.0, 0.0], shape.faces, process=False)


def two_balls() -> trimesh.Trimesh:
    other = trimesh.creation.icosphere(2, 0.05)
    other.apply_translation([0.3, 0, 0])
    return trimesh.util.concatenate([trimesh.creation.icosphere(2, 0.05), other])


def not_finite() -> trimesh.Trimesh:
    shape = trimesh.creation.icosphere(1, 0.05)
    shape.vertices[3] = np.nan
    return shape


@pytest.mark.parametrize(
    ("shape", "reason"),
    [
        (lambda: trimesh.Trimesh(np.eye(3), [[0, 1, 2]], process=False), "at least 4 triangles"),
        (flat, "flat"),
        (sheet, "encloses no volume"),
        (two_balls, "2 separate bodies"),
        (not_finite, "not finite"),
    ],
    ids=["triangle", "flat", "sheet", "two", "nan"],
)
def test_what_is_no_solid_is_refused_with_the_reason(shape, reason: str):
    pytest.importorskip("pytetwild")
    with pytest.raises(InputError, match=reason):
        repaired(mesh_of(shape()))


def holed() -> trimesh.Trimesh:
    shape = trimesh.creation.icosphere(3, 0.05)
    return trimesh.Trimesh(shape.vertices, shape.faces[5:], process=False)


def soup() -> trimesh.Trimesh:
    shape = trimesh.creation.icosphere(3, 0.05)
    return trimesh.Trimesh(shape.vertices[shape.faces].reshape(-1, 3), np.arange(3 * len(shape.faces)).reshape(-1, 3))


def overlapping() -> trimesh.Trimesh:
    other = trimesh.creation.icosphere(2, 0.04)
    other.apply_translation([0.05, 0, 0])
    return trimesh.util.concatenate([trimesh.creation.icosphere(3, 0.05), other])


@pytest.mark.slow
@pytest.mark.parametrize("shape", [holed, soup, overlapping])
@pytest.mark.parametrize("scale", [1.0, 1e-5, 1e5])
def test_defects_are_repaired(shape, scale: float):
    mesh = mesh_of(shape())
    closed = shape_of(even_surface(repaired(Mesh(mesh.points * scale, mesh.faces)), 400))
    assert closed.is_watertight
    assert np.ptp(closed.vertices, axis=0) == pytest.approx(scale * np.ptp(mesh.points, axis=0), rel=0.05)


@pytest.mark.slow
def test_a_mesh_becomes_a_solid_of_its_size():
    shape = trimesh.creation.torus(60.0, 25.0)  # millimetres
    item = placed_object(mesh_of(shape), "ring").item
    assert item.name == "ring"
    assert np.ptp(item.settled, axis=0) == pytest.approx([0.17, 0.17, 0.05], abs=0.004)
    assert shape_of(item.rest_mesh()).is_watertight
    assert len(item.points) <= 1500


@pytest.mark.slow
def test_a_body_that_cannot_rest_is_reported(monkeypatch):
    monkeypatch.setattr("odeform.simulation.objects.settling.REST_SPEED", 0.0)
    item = get_object("donut")
    with pytest.raises(SimulationError, match="does not come to rest"):
        settle(item.points, item.elements, item.material)


def test_a_body_whose_parts_collapse_under_its_weight_is_reported(monkeypatch):
    settling, item = "odeform.simulation.objects.settling", get_object("donut")
    monkeypatch.setattr(f"{settling}._calmed", lambda _: item.points * [1.0, 1.0, -1.0])
    monkeypatch.setattr(f"{settling}.UNDAMPED", 0)
    with pytest.raises(SimulationError, match=r"collapse under its weight: (\d+) of \1 tetrahedra are inside out"):
        settle(item.points, item.elements, item.material)
