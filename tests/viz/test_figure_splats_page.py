"""Gaussian splats of a figure in a browser: where the model has them, in the colours that harmonics say."""

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from browsing import PATIENCE, VIEW, needs_chromium
from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

from odeform.figure import FigureColumn, Source, Sweep, column_bytes, figure_page, interpolated
from odeform.geometry.harmonics import harmonic_basis
from odeform.models.base import Predictor
from odeform.types import GaussianSplats, Mesh
from odeform_figures.opened_page import CHROMIUM, FLAGS

pytestmark = [pytest.mark.slow, needs_chromium]

LATER = 0.2  # s; the ball has turned by then


def splats_of(mesh: Mesh) -> GaussianSplats:
    """Opaque flat splats on a ball, all with the same harmonics."""
    points = np.asarray(mesh.points, dtype=float)
    outward = points - points.mean(axis=0)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    flat = np.eye(3) - outward[:, :, None] * outward[:, None]
    harmonics = 0.25 * np.random.default_rng(4).standard_normal((16, 3))
    harmonics[0] = 0.0
    each = np.tile(harmonics.astype(np.float32), (len(points), 1, 1))
    return GaussianSplats(mesh.points, 36e-6 * flat + 1e-8 * np.eye(3), each, np.ones(len(points)))


@pytest.fixture(scope="module")
def column(kick: Predictor) -> FigureColumn:
    force = next(p for p in kick.schema.parameters if p.name == "force")
    source = Source(kick, (Sweep(force, 60.0, 150.0),), {"azimuth": 0.6}, splats_of(kick.rest))
    return interpolated("odeform", source, kick.schema.window.times[:40], column_bytes(1))


@pytest.fixture(scope="module")
def page(column: FigureColumn, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    path = tmp_path_factory.mktemp("figure") / "splats.html"
    path.write_bytes(figure_page([column]))
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield _opened(browser, path)
        browser.close()


def _opened(browser: Browser, path: Path) -> Page:
    page, said = browser.new_page(viewport=VIEW), []
    page.set_default_timeout(1e3 * PATIENCE)
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.goto(f"{path.as_uri()}#paused")
    page.wait_for_function("window.figure && window.figure.frames > 0")
    assert said == []
    return page


def show(page: Page, time: float, azimuth: float = 0.0) -> None:
    page.get_by_role("slider", name="Time", exact=True).evaluate(
        "(slider, value) => { slider.value = value; slider.dispatchEvent(new Event('input')); }", time
    )
    page.evaluate("angle => Object.assign(window.figure.camera, { azimuth: angle, elevation: 0.4 })", azimuth)
    page.evaluate("window.figure.shown = true")
    page.wait_for_function("!window.figure.shown")


def middle_color(page: Page) -> np.ndarray:
    """(3,) of the pixels in the middle of the view, which the camera looks at."""
    shot = page.locator("#view").screenshot(timeout=1e3 * PATIENCE)
    pixels = np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(float)
    height, width = pixels.shape[0] // 2, pixels.shape[1] // 2
    return pixels[height - 4 : height + 4, width - 4 : width + 4].mean(axis=(0, 1))


@pytest.mark.parametrize("time", [0.0, 0.011, LATER])
def test_centres_are_where_the_model_has_them(page: Page, column: FigureColumn, kick: Predictor, time: float) -> None:
    show(page, time)
    drawn = np.array(page.evaluate("Array.from(window.figure.columns[0].splats.places)")).reshape(-1, 3)
    force = column.source.complete(np.array([page.evaluate("Number(document.querySelector('#sliders input').value)")]))
    expected = kick.solve(column.source.geometry, force).vertices(time)
    assert 1e3 * np.sqrt(np.square(drawn - expected).sum(axis=1).mean()) < 2.0 * column.error.worst
    np.testing.assert_allclose(
        drawn, column.points(_place(page), np.array([time]))[0], atol=2e-5
    )  # coefficients below a micrometre are not drawn


def _place(page: Page) -> np.ndarray:
    return np.array([page.evaluate("Number(document.querySelector('#sliders input').value)")])


@pytest.mark.parametrize("time", [0.0, LATER])
def test_colours_follow_the_view_in_the_axes_of_the_body(
    page: Page, column: FigureColumn, kick: Predictor, time: float
) -> None:
    geometry = column.source.geometry
    assert isinstance(geometry, GaussianSplats)
    motion = kick.solve(geometry, column.source.complete(_place(page)))
    seen = []
    for azimuth in (0.0, 1.5, 3.0, 4.5):
        show(page, time, azimuth)
        eye, target = (np.array(page.evaluate(f"window.figure.camera.{name}")) for name in ("eye", "target"))
        toward = (target - eye) / np.linalg.norm(target - eye)
        local = motion.pose(time)[:3, :3].T @ toward
        expected = 0.5 + harmonic_basis(local, 3) @ geometry.harmonics[0]
        found = middle_color(page)
        np.testing.assert_allclose(found, 255.0 * np.clip(expected, 0.0, 1.0), atol=12.0)
        seen.append(found)
    assert np.ptp(seen, axis=0).max() > 60.0
