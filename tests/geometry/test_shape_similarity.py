"""Which shapes count as the trained body, and how far the others are from it."""

import numpy as np
import pytest
import trimesh

from odeform.formats.bundled import read_shape
from odeform.geometry.primitives import octasphere
from odeform.geometry.shape import fit_to
from odeform.geometry.shape_similarity import ShapeSimilarity, compare_shapes
from odeform.types import Mesh, PointCloud, Points

BALL = octasphere(0.1, segments=24)


def sphere(subdivisions: int = 4, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Mesh:
    ball = trimesh.creation.icosphere(subdivisions, 0.1)
    return Mesh(np.asarray(ball.vertices * scale, np.float32), np.asarray(ball.faces, np.int32))


def to_body(shape: Mesh | PointCloud) -> ShapeSimilarity:
    return compare_shapes(fit_to(shape, BALL).geometry, [BALL])


def part(points: Points, kept: np.ndarray) -> PointCloud:
    return PointCloud(np.asarray(points)[kept])


def test_the_body_itself_has_no_distance() -> None:
    found = compare_shapes(BALL, [BALL])
    assert (found.distance, found.mean, found.same) == (0.0, 0.0, True)
    assert found.tolerance == pytest.approx(0.004)


@pytest.mark.parametrize("subdivisions", [2, 3, 4])
def test_other_meshes_and_points_of_the_same_ball_count_as_it(subdivisions: int) -> None:
    assert to_body(sphere(subdivisions)).same
    assert to_body(PointCloud(sphere(subdivisions).points)).same


def test_the_bundled_splats_are_of_the_same_ball() -> None:
    splats, region = read_shape("volleyball")
    found = compare_shapes(fit_to(splats, BALL, region).geometry, [BALL])
    assert found.same
    assert 1e-3 < found.distance < 3e-3


def test_other_shapes_do_not() -> None:
    torus = trimesh.creation.torus(0.07, 0.03)
    box = trimesh.creation.box((0.2, 0.2, 0.2))
    for shape in (torus, box, trimesh.creation.capsule(0.1, 0.05)):
        found = to_body(Mesh(np.asarray(shape.vertices, np.float32), np.asarray(shape.faces, np.int32)))
        assert not found.same
        assert found.distance > 2.0 * found.tolerance
        assert "was not trained" in found.describe()


@pytest.mark.parametrize(("flatter", "same"), [(0.99, True), (0.96, False), (0.9, False)])
def test_a_flatter_ball_counts_up_to_the_tolerance(flatter: float, same: bool) -> None:
    assert to_body(sphere(scale=(1.0, 1.0, flatter))).same is same


def test_a_part_is_another_shape() -> None:
    """Its points lie on the ball, but the rest of the ball is missing."""
    points = sphere(3).points
    assert not to_body(part(points, points[:, 2] > 0.0)).same
    assert not compare_shapes(part(points, np.arange(len(points)) < 3), [BALL]).same


def test_a_thin_part_that_sticks_out_is_found() -> None:
    ball = trimesh.creation.icosphere(4, 0.1)
    stick = trimesh.creation.cylinder(0.01, 0.1, transform=trimesh.transformations.translation_matrix([0.14, 0.0, 0.0]))
    both = trimesh.util.concatenate([ball, stick])
    assert not compare_shapes(Mesh(np.asarray(both.vertices, np.float32), np.asarray(both.faces)), [BALL]).same


def test_the_most_similar_of_several_bodies_counts() -> None:
    low, high = (Mesh(BALL.points + np.float32([0.0, 0.0, z]), BALL.faces) for z in (0.0, 0.5))
    for body in (low, high):
        assert compare_shapes(body, [low, high]).distance == 0.0
    assert not compare_shapes(high, [low]).same


def test_distances_are_those_of_the_surfaces() -> None:
    moved = compare_shapes(Mesh(BALL.points + np.float32([0.0, 0.0, 0.03]), BALL.faces), [BALL])
    assert moved.distance == pytest.approx(0.03, rel=0.05)
    # the mean of |sqrt(r^2 + d^2 + 2 r d cos) - r| over a sphere is d / 2 for small d
    assert moved.mean == pytest.approx(0.015, rel=0.1)
