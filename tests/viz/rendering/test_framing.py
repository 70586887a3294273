"""Each body is whole and unobscured, whatever the number of columns."""

import math

import numpy as np
import pytest

from odeform.types import Floats
from odeform_viz.rendering.framing import TITLE, Axes, Box, Camera, Framing, Viewport, frame_columns, free_area
from odeform_viz.rendering.lights import towards_key

EXTENT = 0.2  # m
HALF = 0.5 * EXTENT
AXES = Axes.beside(None)


def project(points: Floats, camera: Camera, viewport: Viewport) -> Floats:
    """(N, 2) px from the top left corner of the page."""
    towards = (camera.look_at - camera.position) / np.linalg.norm(camera.look_at - camera.position)
    away = points - camera.position
    right = np.cross(towards, [0.0, 0.0, 1.0]) / np.linalg.norm(towards[:2])
    above = np.cross(right, towards)
    scale = 0.5 * viewport[1] / math.tan(0.5 * camera.fov) / (away @ towards)
    return np.stack([0.5 * viewport[0] + away @ right * scale, 0.5 * viewport[1] - away @ above * scale], axis=1)


def swept(height: float) -> Floats:
    """(24, 3) m: outline of what a round body of `EXTENT` sweeps on its way up to `height`."""
    angle = np.linspace(0.0, 2.0 * math.pi, 12, endpoint=False)
    ring = HALF * np.stack([np.cos(angle), np.sin(angle), np.zeros(12)], axis=1)
    top = np.array([0.0, 0.0, height])
    return np.concatenate([ring, ring + top])


def framed(count: int, height: float, viewport: Viewport, together: bool = False, level: bool = False) -> Framing:
    """Bodies that move up to `height`."""
    across, upwards = swept(height) @ AXES.right, swept(height) @ AXES.above
    box = Box(across.min(), across.max(), upwards.min(), upwards.max())
    return frame_columns(count, AXES, box, EXTENT, viewport, together, level)


@pytest.mark.parametrize("viewport", [(1440, 900), (1280, 720), (400, 860)])
@pytest.mark.parametrize("height", [EXTENT, 0.35, 0.75])
@pytest.mark.parametrize("count", range(1, 9))
def test_bodies_and_titles_are_within_the_free_area_and_apart(viewport: Viewport, height: float, count: int) -> None:
    framing = framed(count, height, viewport)
    left, top, right, bottom = free_area(viewport)
    areas = []
    for offset in framing.offsets:
        pixels = project(swept(height) + offset, framing.camera(viewport), viewport)
        low, high = pixels.min(axis=0), pixels.max(axis=0)
        if count > 1:
            title = project((offset + framing.title)[None], framing.camera(viewport), viewport)[0]
            assert title[1] >= high[1] - 1.0  # under the body
            high = np.maximum(high, title + np.array([0.0, 0.8 * TITLE]))
        assert (low >= (left, top)).all()
        assert (high <= (right, bottom)).all()
        areas.append((low, high))
    for index, (low, high) in enumerate(areas):
        for other_low, other_high in areas[index + 1 :]:
            assert (np.maximum(low, other_low) >= np.minimum(high, other_high)).any()


def test_all_columns_are_seen_from_the_same_angle() -> None:
    framing = framed(8, 0.35, (1440, 900))
    rays = np.stack([offset - framing.camera((1440, 900)).position for offset in framing.offsets])
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    assert np.degrees(np.arccos(np.clip(rays @ rays.T, -1.0, 1.0))).max() < 13.0


def test_columns_stay_on_the_floor_of_a_captured_scene() -> None:
    framing = framed(4, 0.3, (1440, 900), level=True)
    assert np.abs([offset[2] for offset in framing.offsets]).max() < 1e-12
    assert len({tuple(offset) for offset in framing.offsets}) == 4


def test_overlaid_columns_share_one_place() -> None:
    framing = framed(3, 0.3, (1440, 900), together=True)
    assert len(framing.offsets) == 3
    assert np.abs(framing.offsets).max() == 0.0


@pytest.mark.parametrize("count", [1, 5])
def test_a_smaller_browser_sees_all_of_the_same_columns(count: int) -> None:
    framing = framed(count, 0.3, (1440, 900))
    for viewport in ((1280, 720), (390, 844)):
        left, top, right, bottom = free_area(viewport)
        for offset in framing.offsets:
            pixels = project(swept(0.3) + offset, framing.camera(viewport), viewport)
            assert (pixels >= (left, top)).all()
            assert (pixels <= (right, bottom)).all()


@pytest.mark.parametrize("height", [EXTENT, 0.6])
def test_a_body_alone_fills_the_free_height(height: float) -> None:
    framing = framed(1, height, (1440, 900))
    pixels = project(swept(height), framing.camera((1440, 900)), (1440, 900))
    _, top, _, bottom = free_area((1440, 900))
    assert np.ptp(pixels[:, 1]) > 0.85 * (bottom - top)


@pytest.mark.parametrize("angle", [0.0, 1.0, 2.5, -2.0])
def test_what_acts_goes_from_left_to_right_with_its_tail_in_front(angle: float) -> None:
    acting = np.array([math.cos(angle), math.sin(angle), -0.4])
    axes = Axes.beside(acting)
    assert acting @ axes.right > 0.7
    assert -0.8 < acting @ axes.direction < -0.2
    assert np.cross(axes.right, axes.above) == pytest.approx(axes.direction)


def test_what_acts_straight_down_gives_the_view_no_direction() -> None:
    np.testing.assert_array_equal(Axes.beside(np.array([0.05, 0.0, -1.0])).direction, AXES.direction)


@pytest.mark.parametrize("height", [EXTENT, 0.6])
@pytest.mark.parametrize("count", [2, 4, 5, 7, 8, 12])
def test_shadows_fall_on_no_floor_but_the_own(count: int, height: float) -> None:
    framing, towards = framed(count, height, (1440, 900)), towards_key(AXES)
    for index, offset in enumerate(framing.offsets):
        for other, floor in enumerate(framing.offsets):
            down = np.linspace(HALF, height, 20) + offset[2] - floor[2]
            if other == index or (down < 0.0).all():
                continue
            down = down[down > 0.0]
            centres = (offset - floor)[:2] - (down / towards[2])[:, None] * towards[:2]
            assert np.linalg.norm(centres, axis=1).min() > framing.stage
