"""Solids that points outline."""

import numpy as np
import pytest
import trimesh

from odeform.errors import InputError
from odeform.simulation.objects.enclosing import enclosing_surface

pytest.importorskip("manifold3d")


def test_points_of_a_torus_give_a_closed_torus_of_its_size() -> None:
    torus = trimesh.creation.torus(3.0, 1.2, major_sections=64, minor_sections=40)
    points = np.concatenate([np.asarray(torus.vertices), [[40.0, 0.0, 0.0]]])  # one is astray
    mesh = enclosing_surface(points)
    found = trimesh.Trimesh(mesh.points, mesh.faces)
    assert found.is_watertight
    assert found.euler_number == 0
    assert found.volume == pytest.approx(torus.volume, rel=0.15)
    assert np.allclose(found.extents, torus.extents, atol=0.4)


def test_points_of_a_plane_or_too_few_are_refused() -> None:
    plane = np.random.default_rng(0).uniform(size=(4000, 3)) * [1.0, 1.0, 0.0]
    with pytest.raises(InputError, match="enclose no volume"):
        enclosing_surface(plane)
    with pytest.raises(InputError, match="at least 300 points"):
        enclosing_surface(plane[:50])
