"""Columns side by side in the real page: whole, unobscured, with titles that can be read.

Screenshots are kept where pytest keeps temporary files: `pytest --basetemp=FOLDER`.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browsing import Tab, needs_chromium, open_tab, until
from PIL import Image
from rendering.test_framing import project

from odeform.models.base import Predictor
from odeform.types import Floats
from odeform_viz.columns import Column
from odeform_viz.rendering.framing import Camera
from odeform_viz.view import Frame

pytestmark = [pytest.mark.slow, needs_chromium]

SIZES = ((1440, 900), (1280, 720))
PANELS = """() => [...document.querySelectorAll('body *')].filter(e => {
    const s = getComputedStyle(e);
    return s.position === 'absolute' && s.boxShadow !== 'none' && e.offsetWidth > 150 && e.offsetHeight > 60;
}).map(e => { const r = e.getBoundingClientRect(); return [r.left, r.top, r.right, r.bottom]; })"""


@pytest.fixture(scope="module")
def tab(kick: Predictor) -> Iterator[Tab]:
    for tab in open_tab(Column("odeform", kick, kick.rest, origin="kick")):
        # a notification says that the browser renders in software
        tab.page.add_style_tag(content=".mantine-Notifications-root { display: none }")
        yield tab


def _show(tab: Tab, count: int) -> None:
    """Columns pinned along the elevation, at the top of the first flight."""
    app = tab.app
    (first,) = (c for c in app.columns.all if c.pinned is None)
    pins = [app.session.schema.complete({"elevation": e}) for e in np.linspace(0.5, 0.785, count)[1:]]
    others = [replace(first, label=f"elevation {p['elevation']:.3g} rad", pinned=p) for p in pins]
    app.columns.replace_all([first, *others])
    app.page.columns_changed()
    app.page.pause_at(0.1)
    keys = [column.key for column in app.columns.all]  # not the frame of a test before, with as many columns
    assert until(lambda: (f := app.presenter.frame) is not None and _keys(f) == keys and app.presenter.settled)


def _keys(frame: Frame) -> list[int]:
    return [shown.column.key for shown in frame.columns]


def _is_of(viewport: tuple[int, int], size: tuple[int, int]) -> bool:
    """Whether a canvas fills a browser of that size; a slow browser draws fewer pixels."""
    return viewport[0] / viewport[1] == pytest.approx(size[0] / size[1], rel=0.01)


def _camera(tab: Tab, size: tuple[int, int]) -> Camera:
    """The browser's own, once it has been aimed: a message that it sent before may arrive later."""
    client = max(tab.app.server.get_clients().values(), key=lambda c: c.camera.image_width)

    def aimed() -> Camera:
        return tab.app.scene._framing.camera((client.camera.image_width, client.camera.image_height))

    def arrived() -> bool:
        camera, expected = client.camera, aimed()
        return _is_of((camera.image_width, camera.image_height), size) and all(
            np.allclose(getattr(camera, part), getattr(expected, part), atol=1e-3)
            for part in ("position", "look_at", "fov")
        )

    assert until(arrived)
    return aimed()


def _bodies(tab: Tab) -> list[Floats]:
    """Where the vertices (N, 3) of each column are drawn, in m."""
    views, frame, out = tab.app.scene._views, tab.app.presenter.frame, []
    assert frame is not None
    for shown in frame.columns:
        view = views[shown.column.key][1]
        points = shown.column.geometry.points if shown.points is None else shown.points
        pose = view._body
        turn = shown.pose[:3, :3]
        world = tab.app.scene._stage._world.position
        out.append(points @ turn.T + pose.position + view.offset + world)
    return out


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("count", [1, 2, 3, 5, 8])
def test_every_body_is_whole_and_unobscured(tab: Tab, count: int, size: tuple[int, int], tmp_path: Path) -> None:
    tab.page.set_viewport_size({"width": size[0], "height": size[1]})
    assert until(lambda: _is_of(tab.app.scene.viewport, size))
    _show(tab, count)
    shown = tab.app.presenter
    assert until(lambda: shown.settled and _is_of(shown._options.viewport, size))
    camera = _camera(tab, size)
    areas = [project(points, camera, size) for points in _bodies(tab)]
    boxes = [(pixels.min(axis=0), pixels.max(axis=0)) for pixels in areas]
    panels = _panels(tab, size)
    assert len(panels) >= 2
    for index, (low, high) in enumerate(boxes):
        assert (low >= 0.0).all()
        assert (high <= size).all()
        assert (high - low).min() > 40.0  # px: large enough to look at
        for other_low, other_high in (*boxes[index + 1 :], *((p[:2], p[2:]) for p in panels)):
            assert (np.maximum(low, other_low) >= np.minimum(high, other_high)).any()
    path = tmp_path / f"columns_{count}_{size[0]}.png"
    assert until(lambda: _drawn(tab, [0.5 * (low + high) for low, high in boxes], path))
    assert tab.errors == []


def _panels(tab: Tab, size: tuple[int, int]) -> list[Floats]:
    """(left, top, right, bottom) of each panel, in pixels, once the browser has moved them with the window's edge."""

    def now() -> list[Floats]:
        return [np.array(rectangle) for rectangle in tab.page.evaluate(PANELS)]

    assert until(lambda: any(size[0] - 40 < right <= size[0] for _, _, right, _ in now()))
    return now()


def _drawn(tab: Tab, middles: list[Floats], path: Path) -> bool:
    """Whether a screenshot shows each body at its place: its clay is warm, and the background is not."""
    tab.page.screenshot(path=path)
    picture = np.asarray(Image.open(path).convert("RGB")).astype(int)
    around = [picture[y - 3 : y + 4, x - 3 : x + 4] for x, y in np.round(middles).astype(int)]
    return all((pixels[..., 0] - pixels[..., 2]).max() > 3 for pixels in around)
