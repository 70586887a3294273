"""The meshing that made the seven objects."""

import numpy as np
import pytest
import trimesh

from odeform.types import Mesh, Perpoint, Points
from odeform_figures.bodies.level_set import surface_of
from odeform_figures.bodies.remesh import remesh
from odeform_figures.bodies.tetrahedra import tetrahedralise


def ball(points: Points) -> Perpoint:
    return np.linalg.norm(points - [0.01, 0.02, 0.03], axis=1) - 0.05


def mesh_of(shape: trimesh.Trimesh) -> Mesh:
    return Mesh(np.asarray(shape.vertices, dtype=float), np.asarray(shape.faces, dtype=np.int32))


def shape_of(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.points, mesh.faces, process=False)


def test_a_level_set_is_closed_and_lies_on_the_surface():
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
    pytest.importorskip("pyvista")  # pytetwild imports it
    fine = mesh_of(trimesh.creation.icosphere(2, 0.05))
    points, elements, faces = tetrahedralise(fine, 0.02)
    corners = points[elements]
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1]).sum() / 6.0
    assert volume == pytest.approx(shape_of(fine).volume, rel=0.02)
    assert set(np.unique(faces)) == set(range(faces.max() + 1))
    assert shape_of(Mesh(points, faces)).volume == pytest.approx(volume)
