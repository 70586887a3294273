"""The bundled objects: sound meshes of real size, at rest on the floor."""

import numpy as np
import pytest
import trimesh

from odeform.errors import InputError
from odeform.io import bundled
from odeform.simulation.objects.catalog import OBJECTS, get_object
from odeform.simulation.objects.materials import CHOICE, FORCES, MATERIALS, material_name, material_of
from odeform.types import Mesh

SOLIDS = [name for name in OBJECTS if name != "chip"]
HEIGHTS = {"bottle": 0.2, "cat": 0.28, "dog": 0.29, "donut": 0.056, "chip": 0.007, "flip-flop": 0.07, "pillow": 0.12}


def surface(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.points, mesh.faces, process=False)


@pytest.mark.parametrize("name", OBJECTS)
def test_sizes_are_those_that_a_simulation_can_afford(name: str):
    item = get_object(name)
    assert 1000 <= item.surface_count <= 1300
    assert len(item.points) == len(item.settled) <= 1500
    assert item.elements.max() == len(item.points) - 1


@pytest.mark.parametrize("name", SOLIDS)
def test_surfaces_of_solids_are_closed_and_face_outward(name: str):
    item = get_object(name)
    for points in (item.points, item.settled):
        mesh = surface(Mesh(points[: item.surface_count].astype(np.float32), item.faces))
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.volume > 0.0


@pytest.mark.parametrize(("name", "genus"), [("donut", 1), ("flip-flop", 2), ("bottle", 0), ("pillow", 0)])
def test_holes_are_where_they_belong(name: str, genus: int):
    assert surface(get_object(name).rest_mesh()).euler_number == 2 - 2 * genus


def test_the_chip_is_one_open_sheet():
    mesh = surface(get_object("chip").rest_mesh())
    assert (mesh.euler_number, mesh.body_count) == (1, 1)
    assert mesh.face_normals[:, 2].min() > 0.5


@pytest.mark.parametrize("name", SOLIDS)
def test_no_tetrahedron_is_inside_out_or_flat(name: str):
    item = get_object(name)
    for points in (item.points, item.settled):
        corners = points[item.elements]
        volume = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0
        longest = np.linalg.norm(corners[:, 1:] - corners[:, :1], axis=2).max(axis=1)
        assert (volume / longest**3).min() > 1e-3


@pytest.mark.parametrize("name", OBJECTS)
def test_bodies_rest_on_the_floor_at_the_origin(name: str):
    item = get_object(name)
    assert abs(item.settled[:, 2].min()) < 1e-3
    assert np.abs(item.masses @ item.settled / item.mass)[:2].max() < 1e-4
    assert np.ptp(item.settled[:, 2]) == pytest.approx(HEIGHTS[name], rel=0.1)


@pytest.mark.parametrize("name", OBJECTS)
def test_masses_are_those_of_the_material(name: str):
    item = get_object(name)
    mesh = surface(Mesh(item.points[: item.surface_count], item.faces))
    size = mesh.area * item.material.thickness if name == "chip" else mesh.volume
    assert item.mass == pytest.approx(item.material.density * size, rel=1e-3)
    assert item.weights.sum() == pytest.approx(1.0)
    assert item.weights.min() > 0.0


@pytest.mark.parametrize("name", OBJECTS)
def test_files_hold_the_materials_of_the_code(name: str):
    item = get_object(name)
    assert (item.material, item.forces) == (MATERIALS[name], FORCES[name])
    assert item.material.source


def test_all_files_together_are_small():
    assert sum(path.stat().st_size for path in bundled("objects").iterdir()) < 2e6


def test_an_unknown_name_is_refused():
    with pytest.raises(InputError, match="expected one of bottle, cat"):
        get_object("teapot")


@pytest.mark.parametrize("name", [*CHOICE, "70:120", "0.5:30"])
def test_a_material_is_named_as_it_is_read(name: str) -> None:
    assert material_name(material_of(name)) == name
