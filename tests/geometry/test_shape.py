from dataclasses import replace

import numpy as np
import pytest
import trimesh

from odeform.errors import InputError
from odeform.geometry.region import Sphere
from odeform.geometry.shape import fit_to, surface_weights, without_outliers
from odeform.geometry.similarity import UPRIGHT, Similarity
from odeform.types import GaussianSplats, Mesh, PointCloud


def ball(level: int, radius: float = 0.1, centre: tuple[float, float, float] = (0.0, 0.0, 0.1)) -> Mesh:
    sphere = trimesh.creation.icosphere(level, radius)
    return Mesh(np.asarray(sphere.vertices) + centre, np.asarray(sphere.faces))


def test_shares_are_thirds_of_the_adjacent_faces() -> None:
    # two triangles of areas 1/2 and 3/2 on one edge, and a point on neither
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -3, 0], [5, 5, 5]], dtype=float)
    mesh = Mesh(points, np.array([[0, 1, 2], [0, 3, 1]]))
    assert np.allclose(surface_weights(mesh), np.array([2.0, 2.0, 0.5, 1.5, 0.0]) / 6.0)


def test_shares_weigh_area_not_points() -> None:
    """A ball, finer on one half: its shares still have the ball's centre as their mean."""
    mesh = ball(3).points - [0.0, 0.0, 0.1], ball(3).faces
    fine = trimesh.Trimesh(*mesh, process=False)
    upper = np.flatnonzero(fine.triangles_center[:, 2] > 0.0)
    vertices, faces = trimesh.remesh.subdivide(fine.vertices, fine.faces, face_index=upper)
    points = vertices * (0.1 / np.linalg.norm(vertices, axis=1, keepdims=True))
    shares = surface_weights(Mesh(points, faces))
    assert points.mean(axis=0)[2] > 1e-2
    assert np.abs(shares @ points).max() < 5e-4


@pytest.mark.parametrize(
    "shape", [PointCloud(np.eye(3)), Mesh(np.eye(3), np.array([[0, 0, 1]]))], ids=["points", "no area"]
)
def test_shares_without_area_are_equal(shape: PointCloud | Mesh) -> None:
    assert np.allclose(surface_weights(shape), 1.0 / 3.0)


def test_fit_stands_on_the_same_floor() -> None:
    rng = np.random.default_rng(0)
    shape = PointCloud(rng.uniform([3.0, -7.0, 40.0], [5.0, 1.0, 44.0], size=(500, 3)))
    reference = ball(2, centre=(1.0, 2.0, 0.1))
    fit = fit_to(shape, reference)
    low, high = fit.geometry.points.min(axis=0), fit.geometry.points.max(axis=0)
    assert (high - low).max() == pytest.approx(0.2, abs=1e-6)
    assert np.allclose(0.5 * (low + high)[:2], [1.0, 2.0], atol=1e-6)
    assert low[2] == pytest.approx(0.0, abs=1e-6)
    assert np.allclose(fit.geometry.points, fit.transform.factor * shape.points + fit.transform.shift, atol=1e-5)


def test_fit_leaves_what_fits() -> None:
    reference = ball(2)
    fit = fit_to(reference, reference)
    assert fit.transform.factor == 1.0
    assert np.allclose(fit.geometry.points, reference.points, atol=1e-7)


def test_fit_scales_splats() -> None:
    points = np.random.default_rng(0).normal(size=(9, 3))
    splats = GaussianSplats(points, np.tile(np.eye(3), (9, 1, 1)), np.ones((9, 4, 3)), np.ones(9))
    fit = fit_to(splats, ball(2))
    assert isinstance(fit.geometry, GaussianSplats)
    assert np.allclose(fit.geometry.covariances, fit.transform.factor**2 * np.eye(3))
    assert fit.geometry.harmonics is splats.harmonics
    moved = replace(splats, points=100.0 * points + 7.0)
    assert np.allclose(fit_to(moved, ball(2)).geometry.points, fit.geometry.points, atol=1e-6)


def scene(up: str, factor: float = 40.0) -> tuple[PointCloud, Sphere]:
    """A ball on a large floor in a file with its own units and its own way up, and a region about the ball."""
    rng = np.random.default_rng(4)
    around = np.concatenate([rng.uniform(-1.0, 1.0, (4000, 2)), np.full((4000, 1), -2e-3)], axis=1)
    place = Similarity(factor, UPRIGHT[up].T, np.array([7.0, -30.0, 2.0]))
    points = place.points(np.concatenate([ball(3).points, around]))
    return PointCloud(points), Sphere(np.array([0.0, 0.0, 0.102]), 0.1025).transformed(place)


@pytest.mark.parametrize("up", UPRIGHT)
def test_a_part_is_turned_so_that_its_surroundings_are_below(up: str) -> None:
    shape, region = scene(up)
    fit = fit_to(shape, ball(2), region)
    assert np.array_equal(fit.transform.rotation, UPRIGHT[up])
    assert len(fit.geometry.points) == 642
    assert np.allclose(fit.geometry.points.min(axis=0), [-0.1, -0.1, 0.0], atol=1e-5)
    assert fit.static is not None
    assert np.allclose(fit.static.points[:, 2], -2e-3, atol=1e-5)
    # an own turn, and an own place, are taken as they are
    assert np.array_equal(fit_to(shape, ball(2), region, UPRIGHT["+x"]).transform.rotation, UPRIGHT["+x"])
    assert fit_to(shape, ball(2), region, transform=fit.transform).transform is fit.transform


def test_what_stands_still_is_not_lifted_with_a_body_that_is_dropped() -> None:
    shape, region = scene("+z")
    fit = fit_to(shape, ball(2, centre=(0.0, 0.0, 0.5)), region)
    assert fit.lift == pytest.approx(0.4)
    assert fit.geometry.points[:, 2].min() == pytest.approx(0.4, abs=1e-5)
    assert fit.static is not None
    assert np.allclose(fit.static.points[:, 2], -2e-3, atol=1e-5)


def test_far_points_of_a_part_do_not_count() -> None:
    shape, _ = scene("+z", factor=1.0)
    part = PointCloud(np.concatenate([shape.points, shape.points[:1] + np.array([0.0, 0.0, 0.9])]))
    fit = fit_to(part, ball(2), Sphere(np.array([7.0, -30.0, 2.71]), 0.7105))
    assert np.ptp(fit.geometry.points, axis=0).max() > 0.5
    assert fit.transform.factor == pytest.approx(1.0, abs=1e-3)


def test_undone_it_is_the_file_again() -> None:
    shape, region = scene("-y")
    fit = fit_to(shape, ball(2), region)
    back = fit.to_file(fit.geometry)
    inside = region.contains(shape.points)
    assert np.allclose(back.points, np.concatenate([shape.points[inside], shape.points[~inside]]), atol=1e-4)
    assert fit.remainder is not None
    assert np.array_equal(back.points[inside.sum() :], fit.remainder.points)  # what stood still, to the last bit


def test_an_empty_region_is_refused() -> None:
    shape, _ = scene("+z")
    with pytest.raises(InputError, match="region contains 0 of"):
        fit_to(shape, ball(2), Sphere(np.array([1e3, 0.0, 0.0]), 1.0))


def test_surroundings_count_up_to_twice_the_radius_of_a_part() -> None:
    """A floor right below a ball, and a ceiling with more points three radii above its centre."""
    rng = np.random.default_rng(1)

    def layer(height: float, count: int) -> np.ndarray:
        return np.concatenate([rng.uniform(-0.02, 0.02, (count, 2)), np.full((count, 1), height)], axis=1)

    region = Sphere(np.array([0.0, 0.0, 0.1]), 0.1025)
    for height, up in ((0.1 + 0.25, "+z"), (0.1 + 0.15, "-z")):
        shape = PointCloud(np.concatenate([ball(3).points, layer(-4e-3, 50), layer(height, 5000)]))
        assert np.array_equal(fit_to(shape, ball(2), region).transform.rotation, UPRIGHT[up])


def test_strays_are_beyond_one_and_a_half_times_the_distance_of_nineteen_in_twenty() -> None:
    line = np.linspace(-1.0, 1.0, 401)[:, None] * [1.0, 0.0, 0.0]
    for far, kept in ((1.40, True), (1.46, False)):
        points = np.concatenate([line, [[0.0, far, 0.0]]])
        assert (len(without_outliers(points)) == 402) == kept


def test_a_shape_without_extent_keeps_its_size() -> None:
    fit = fit_to(PointCloud(np.full((3, 3), 7.0)), ball(2))
    assert fit.transform.factor == 1.0
    assert np.allclose(fit.geometry.points, [0.0, 0.0, 0.0], atol=1e-6)
