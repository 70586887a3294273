from dataclasses import replace

import numpy as np
import pytest
import trimesh

from odeform.errors import InputError
from odeform.geometry.parts import concatenated, most_visible, split
from odeform.geometry.region import Box, Sphere
from odeform.types import GaussianSplats, Mesh, PointCloud

POINTS = np.random.default_rng(0).uniform(-1.0, 1.0, size=(300, 3))
MIDDLE = Sphere(np.zeros(3), 0.6)
NOWHERE = Box(np.full(3, 9.0), np.ones(3))
SPLATS = GaussianSplats(
    POINTS, np.tile(np.eye(3), (300, 1, 1)), np.arange(900.0).reshape(300, 1, 3), np.linspace(0.0, 1.0, 300)
)


def test_splats_in_two_and_together_again() -> None:
    part, left = split(SPLATS, MIDDLE)
    assert isinstance(part, GaussianSplats)
    assert left is not None
    assert MIDDLE.contains(part.points).all()
    assert not MIDDLE.contains(left.points).any()
    both = concatenated(part, left)
    assert isinstance(both, GaussianSplats)
    order, same = (np.argsort(s.harmonics[:, 0, 0]) for s in (both, SPLATS))
    for name in ("points", "covariances", "harmonics", "opacities"):
        assert np.array_equal(getattr(both, name)[order], getattr(SPLATS, name)[same])


def test_a_mesh_is_split_between_faces() -> None:
    one, other = trimesh.creation.icosphere(2, 0.5), trimesh.creation.icosphere(1, 0.2)
    other.apply_translation([2.0, 0.0, 0.0])
    both = trimesh.util.concatenate([one, other])
    mesh = Mesh(np.asarray(both.vertices), np.asarray(both.faces))
    part, left = split(mesh, Sphere(np.array([2.0, 0.0, 0.0]), 0.3))
    assert isinstance(part, Mesh)
    assert isinstance(left, Mesh)
    assert (len(part.points), len(part.faces)) == (len(other.vertices), len(other.faces))
    assert (len(left.points), len(left.faces)) == (len(one.vertices), len(one.faces))
    again = concatenated(part, left)
    assert isinstance(again, Mesh)
    assert trimesh.Trimesh(again.points, again.faces).volume == pytest.approx(both.volume)
    # across the middle of one: every face is in one part
    part, left = split(mesh, Box(np.array([0.0, 0.0, 0.5]), np.ones(3)))
    assert isinstance(part, Mesh)
    assert isinstance(left, Mesh)
    assert len(part.faces) + len(left.faces) == len(mesh.faces)


@pytest.mark.parametrize("shape", [SPLATS, PointCloud(POINTS), Mesh(POINTS, np.arange(300).reshape(100, 3))])
def test_a_region_that_holds_nothing_is_refused(shape: GaussianSplats | PointCloud | Mesh) -> None:
    with pytest.raises(InputError, match="region contains"):
        split(shape, NOWHERE)


def test_a_region_that_holds_all_leaves_nothing() -> None:
    part, left = split(PointCloud(POINTS), Sphere(np.zeros(3), 9.0))
    assert left is None
    assert len(concatenated(part, left).points) == 300


def test_of_too_many_splats_the_most_visible_stay() -> None:
    """Large and opaque ones; a long needle covers little."""
    covariances = SPLATS.covariances.copy()
    covariances[250:] = np.diag([9.0, 1e-6, 1e-6])
    kept = most_visible(replace(SPLATS, covariances=covariances), 100)
    assert sorted(kept.opacities) == sorted(SPLATS.opacities[150:250])
    assert kept.notes == ("the 100 most visible of 300 splats",)
    assert most_visible(SPLATS, 300) is SPLATS
