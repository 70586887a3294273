"""Each body is whole and unobscured, whatever the number of columns."""

import math

import numpy as np
import pytest

from odeform.types import Floats
from odeform_viz.rendering.framing import ABOVE, RIGHT, TITLE, Camera, Viewport, frame_columns, free_area

EXTENT = 0.2  # m
HALF = 0.5 * EXTENT


def project(points: Floats, camera: Camera, viewport: Viewport) -> Floats:
    """(N, 2) px from the top left corner of the page."""
    towards = (camera.look_at - camera.position) / np.linalg.norm(camera.look_at - camera.position)
    away = points - camera.position
    scale = 0.5 * viewport[1] / math.tan(0.5 * camera.fov) / (away @ towards)
    return np.stack([0.5 * viewport[0] + away @ RIGHT * scale, 0.5 * viewport[1] - away @ ABOVE * scale], axis=1)


def swept(height: float) -> Floats:
    """(24, 3) m: outline of what a round body of `EXTENT` sweeps on its way up to `height`."""
    angle = np.linspace(0.0, 2.0 * math.pi, 12, endpoint=False)
    ring = HALF * np.stack([np.cos(angle), np.sin(angle), np.zeros(12)], axis=1)
    top = np.array([0.0, 0.0, height])
    return np.concatenate([ring, ring + top])


@pytest.mark.parametrize("viewport", [(1440, 900), (1280, 720), (400, 860)])
@pytest.mark.parametrize("height", [EXTENT, 0.35, 0.75])
@pytest.mark.parametrize("count", range(1, 9))
def test_bodies_and_titles_are_within_the_free_area_and_apart(viewport: Viewport, height: float, count: int) -> None:
    framing = frame_columns(count, EXTENT, height, viewport, together=False, level=False)
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
    framing = frame_columns(8, EXTENT, 0.35, (1440, 900), together=False, level=False)
    rays = np.stack([offset - framing.camera((1440, 900)).position for offset in framing.offsets])
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    assert np.degrees(np.arccos(np.clip(rays @ rays.T, -1.0, 1.0))).max() < 13.0


def test_columns_stay_on_the_floor_of_a_captured_scene() -> None:
    framing = frame_columns(4, EXTENT, 0.3, (1440, 900), together=False, level=True)
    assert np.abs([offset[2] for offset in framing.offsets]).max() < 1e-12
    assert len({tuple(offset) for offset in framing.offsets}) == 4


def test_overlaid_columns_share_one_place() -> None:
    framing = frame_columns(3, EXTENT, 0.3, (1440, 900), together=True, level=False)
    assert len(framing.offsets) == 3
    assert np.abs(framing.offsets).max() == 0.0


@pytest.mark.parametrize("count", [1, 5])
def test_a_smaller_browser_sees_all_of_the_same_columns(count: int) -> None:
    framing = frame_columns(count, EXTENT, 0.3, (1440, 900), together=False, level=False)
    for viewport in ((1280, 720), (390, 844)):
        left, top, right, bottom = free_area(viewport)
        for offset in framing.offsets:
            pixels = project(swept(0.3) + offset, framing.camera(viewport), viewport)
            assert (pixels >= (left, top)).all()
            assert (pixels <= (right, bottom)).all()
