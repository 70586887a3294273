"""From foreign meshes to soft objects."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from odeform.errors import InputError
from odeform.geometry.contact import nearest_on
from odeform.simulation.errors import SimulationError
from odeform.simulation.objects.canonical import most_like, plausible_scale
from odeform.simulation.objects.catalog import get_object
from odeform.simulation.objects.files import arrays_of, read_object
from odeform.simulation.objects.from_mesh import placed_object
from odeform.simulation.objects.materials import CHOICE, forces_at, forces_on, material_of
from odeform.simulation.objects.settling import settle
from odeform.simulation.objects.thickness import thickness_at, thicknesses
from odeform.types import Mesh


def mesh_of(shape: trimesh.Trimesh) -> Mesh:
    return Mesh(np.asarray(shape.vertices, dtype=float), np.asarray(shape.faces, dtype=np.int32))


def shape_of(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.points, mesh.faces, process=False)


def test_the_thickness_of_a_ball_is_its_diameter():
    assert thicknesses(mesh_of(trimesh.creation.icosphere(3, 0.05))) == pytest.approx(0.1, rel=0.02)


def test_what_is_long_behind_its_tip_is_as_thick_as_it_is_wide():
    bar = mesh_of(trimesh.creation.cylinder(0.02, 0.3, sections=64).subdivide())
    tip = thickness_at(bar, nearest_on(bar, np.array([0.003, 0.002, 0.15])))
    assert 0.02 < tip < 0.04
    plate = mesh_of(trimesh.creation.box((0.3, 0.3, 0.02)))
    assert thickness_at(plate, nearest_on(plate, np.array([0.02, 0.03, 0.01]))) == pytest.approx(0.02, rel=1e-3)


def test_a_thin_place_is_pushed_less_and_a_thick_one_never_more():
    cat = replace(get_object("cat"), forces=(0.9, 3.0))
    rest = cat.rest_mesh()
    ear = nearest_on(rest, rest.points[thicknesses(rest).argmin()].astype(float))
    belly = nearest_on(rest, rest.points.astype(float).mean(axis=0) + np.array([0.0, 0.3, 0.0]))
    assert forces_at(cat, belly) == cat.forces
    weak, strong = forces_at(cat, ear)
    assert strong < 0.5 * cat.forces[1]
    assert weak == pytest.approx(0.3 * strong)


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


@pytest.mark.parametrize("text", ["wood", "60", "60:120:3", "0:100", "60:1e9"])
def test_a_material_is_a_name_or_two_numbers(text: str):
    assert material_of("foam") is CHOICE["foam"]
    assert (material_of("60:120").young, material_of("60:120").density) == (60e3, 120.0)
    with pytest.raises(InputError, match="expected one of plush, dough, foam"):
        material_of(text)


def test_materials_are_listed_from_soft_to_stiff_with_their_sources():
    moduli = [material.young for material in CHOICE.values()]
    assert moduli == sorted(moduli)
    assert all(material.source for material in CHOICE.values())


def test_forces_follow_stiffness_until_weight_limits_them():
    foam = CHOICE["foam"]
    weakest, strongest = forces_on(foam, 0.02, 10.0)
    assert 0.0 < weakest < strongest == pytest.approx(forces_on(foam, 0.08, 10.0)[1] / 8.0)
    assert forces_on(foam, 0.02, 0.01)[1] == pytest.approx(3.0 * 9.81 * 0.01)


@pytest.mark.slow
def test_a_mesh_becomes_a_solid_of_its_size():
    shape = trimesh.creation.torus(60.0, 25.0)  # millimetres
    placed = placed_object(mesh_of(shape), "ring")
    item = placed.item
    assert item.material == CHOICE["plush"]
    assert placed.material.startswith("plush (12 kPa and 50 kg/m³), the softest")
    assert item.name == "ring"
    assert np.ptp(item.settled, axis=0) == pytest.approx([0.17, 0.17, 0.05], abs=0.004)
    assert shape_of(item.rest_mesh()).is_watertight
    assert len(item.points) <= 2500
    assert np.ptp(item.settled[:, 2]) > 0.9 * np.ptp(item.points[:, 2])


def test_a_body_that_cannot_rest_is_reported(monkeypatch):
    monkeypatch.setattr("odeform.simulation.objects.settling.LIMIT", 2)  # steps, which are too few
    item = get_object("donut")
    with pytest.raises(SimulationError, match="does not come to rest"):
        settle(item.points, item.elements, item.material)


def test_a_body_whose_parts_collapse_under_its_weight_is_reported(monkeypatch):
    settling, item = "odeform.simulation.objects.settling", get_object("donut")
    monkeypatch.setattr(f"{settling}.calmed", lambda _: item.points * [1.0, 1.0, -1.0])
    monkeypatch.setattr(f"{settling}.UNDAMPED", 0)
    with pytest.raises(SimulationError, match=r"collapse under its weight: (\d+) of \1 tetrahedra are inside out"):
        settle(item.points, item.elements, item.material)
