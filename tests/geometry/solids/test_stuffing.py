"""Tetrahedra of a lattice that is cut at a surface."""

import numpy as np
import pytest
import trimesh

from odeform.geometry.solids.lattice import cubic_lattice
from odeform.geometry.solids.stuffing import stuff
from odeform.geometry.solids.tetrahedra import boundary, largest_part, outer_first, pulled_apart, qualities, volumes
from odeform.types import Ints, Perpoint, Points


def ring(points: Points) -> Perpoint:
    return np.hypot(np.hypot(points[:, 0], points[:, 1]) - 1.0, points[:, 2]) - 0.35


def stuffed(spacing: float) -> tuple[Points, Ints]:
    return stuff(ring, *cubic_lattice(np.full(3, -1.6), np.full(3, 1.6), spacing))


@pytest.mark.parametrize("spacing", [0.4, 0.23])
def test_a_ring_is_closed_well_shaped_and_on_its_surface(spacing: float) -> None:
    points, elements, faces = outer_first(*stuffed(spacing))
    surface = trimesh.Trimesh(points, faces, process=False)
    assert surface.is_watertight
    assert surface.euler_number == 0
    assert np.abs(ring(points[: faces.max() + 1])).max() < 0.02
    assert volumes(points, elements).min() > 0.0
    assert qualities(points, elements).min() > 0.15


def test_the_boundary_of_one_tetrahedron_faces_outward() -> None:
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    surface = trimesh.Trimesh(corners, boundary(np.array([[0, 1, 2, 3]])), process=False)
    assert surface.volume == pytest.approx(1.0 / 6.0)
    assert qualities(corners, np.array([[0, 1, 2, 3]]))[0] < 1.0


def test_parts_that_touch_at_a_corner_are_two() -> None:
    corner = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    points = np.concatenate([corner, -0.5 * corner[1:]])
    both = np.array([[0, 1, 2, 3], [0, 5, 4, 6]])
    assert len(largest_part(points, both)) == 1
    apart, elements = pulled_apart(points, both)
    assert len(np.unique(elements)) == 8
    assert np.allclose(apart[elements[0]], points[both[0]])
