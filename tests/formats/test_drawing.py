"""Pictures by software."""

import numpy as np
import pytest

from odeform.formats.drawing import AZIMUTH, ELEVATION, PAPER, SHADOW, View, draw
from odeform.types import Floats, GaussianSplats, Mesh, PointCloud

VIEW = View(np.array([0.0, 0.0, 0.1]), 1.0, (160, 120))
RED, BLUE = (200, 0, 0), (0, 0, 200)


def _facing(centre: Floats, side: float) -> Mesh:
    """A right triangle that faces the eye, its legs along the picture's axes."""
    right, up, _ = VIEW.axes
    corners = centre + side * np.array([np.zeros(3), right, up])
    return Mesh(corners, np.array([[0, 1, 2]], np.int32))


def _is_red(picture: np.ndarray) -> np.ndarray:
    return (picture[..., 0] > picture[..., 2].astype(int) + 30).astype(float)


def test_the_view_looks_down_from_its_elevation() -> None:
    right, up, towards = VIEW.axes
    np.testing.assert_allclose(VIEW.axes @ VIEW.axes.T, np.eye(3), atol=1e-12)
    assert towards[2] == pytest.approx(np.sin(ELEVATION))
    assert np.arctan2(towards[1], towards[0]) == pytest.approx(AZIMUTH)
    assert right[2] == 0.0
    assert up[2] > 0.0


def test_a_triangle_covers_its_area() -> None:
    picture = draw(_facing(np.array([0.0, 0.0, 0.2]), 0.3), VIEW, RED)
    pixels = _is_red(picture).sum()
    assert pixels == pytest.approx(0.5 * (0.3 * 120) ** 2, rel=0.05)
    rows, columns = np.nonzero(_is_red(picture))
    corner = VIEW.project(np.array([[0.0, 0.0, 0.2]]))[0, :2] / 2.0
    assert columns.min() == pytest.approx(corner[0], abs=1.5)
    assert rows.max() == pytest.approx(corner[1], abs=1.5)


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_what_is_nearer_hides_what_is_behind(order: tuple[int, int]) -> None:
    near, far = _facing(0.5 * VIEW.axes[2], 0.3), _facing(0.2 * VIEW.axes[2], 0.3)
    both = [near, far]
    colors = np.array([RED, BLUE], np.uint8)
    points = np.concatenate([both[i].points for i in order])
    faces = np.array([[0, 1, 2], [3, 4, 5]], np.int32)
    mesh = Mesh(points, faces, np.repeat(colors[list(order), None], 3, axis=1))
    assert _is_red(draw(mesh, VIEW)).sum() == pytest.approx(0.5 * (0.3 * 120) ** 2, rel=0.05)


def test_a_body_casts_a_shadow_straight_down() -> None:
    plate = 0.1 * np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]]) + [0.0, 0.0, 0.4]
    picture = draw(Mesh(plate, np.array([[0, 1, 2], [0, 2, 3]], np.int32)), VIEW, RED)
    column, row, _ = VIEW.project(np.zeros((1, 3)))[0] / 2.0
    assert (picture[int(row), int(column)] == int(SHADOW * PAPER)).all()
    assert (picture[0, 0] == int(PAPER)).all()


def test_the_squares_of_the_floor_have_their_size() -> None:
    view = View(np.zeros(3), 1.0, (160, 120), tile=0.25)
    floor = view.floor()[..., 0]
    centres = np.array([[0.125, 0.125, 0.0], [0.375, 0.125, 0.0], [0.375, 0.375, 0.0], [-0.125, 0.125, 0.0]])
    columns, rows = view.project(centres)[:, :2].astype(int).T
    first, beside, across, other = floor[rows, columns]
    assert first == across == PAPER
    assert beside == other < PAPER


def test_points_and_splats_are_discs_of_their_colours() -> None:
    grid = 0.1 * np.stack(np.meshgrid(np.arange(-2, 3), np.arange(-2, 3), [3.0]), axis=-1).reshape(-1, 3)
    assert _is_red(draw(PointCloud(grid), VIEW, RED)).sum() > 500
    harmonics = np.tile(np.array([1.5, -1.5, -1.5]), (len(grid), 1, 1))
    splats = GaussianSplats(grid, np.tile(1e-4 * np.eye(3), (len(grid), 1, 1)), harmonics, np.ones(len(grid)))
    assert _is_red(draw(splats, VIEW)).sum() > 500


def test_what_lies_outside_of_the_picture_or_is_seen_from_the_side_is_left_out() -> None:
    towards, right = VIEW.axes[2], VIEW.axes[0]
    corners = np.array(
        [0.5 * towards, 0.7 * towards, 0.6 * towards, 50.0 * right, 50.0 * right + towards, 51.0 * right]
    )
    picture = draw(Mesh(corners, np.array([[0, 1, 2], [3, 4, 5]], np.int32)), VIEW, RED)
    assert not _is_red(picture).any()
