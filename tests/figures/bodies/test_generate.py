"""The seven objects as code makes them."""

import numpy as np
import pytest
import trimesh

from odeform.simulation.objects.catalog import OBJECTS, get_object
from odeform_figures.bodies.generate import generate, proportions
from odeform_figures.bodies.shapes.chip import chip


@pytest.mark.parametrize("name", OBJECTS)
def test_variants_repeat_and_differ(name: str):
    assert proportions(name, None) == {}
    assert proportions(name, 3) == proportions(name, 3) != proportions(name, 4)


def test_chips_have_even_triangles():
    made = chip()
    mesh = trimesh.Trimesh(made.points, made.faces, process=False)
    assert np.degrees(mesh.face_angles.min()) > 15.0
    assert 1000 <= len(mesh.vertices) <= 1300


@pytest.mark.slow
def test_code_rebuilds_the_bundled_donut():
    made, kept = generate("donut"), get_object("donut")
    assert made.mass == pytest.approx(kept.mass, rel=0.01)
    assert np.ptp(made.settled, axis=0) == pytest.approx(np.ptp(kept.settled, axis=0), abs=1e-3)
    assert made.surface_count == pytest.approx(kept.surface_count, rel=0.05)
    assert (made.material, made.forces) == (kept.material, kept.forces)
