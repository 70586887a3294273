"""What a browser downloads from the page opens again, and holds the motion."""

import csv
import io
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import trimesh
from browsing import PATIENCE, VIEW, Tab, needs_chromium, open_tab, until
from PIL import Image

from odeform.dataset.store import open_dataset
from odeform.formats.motion_csv import ERRORS
from odeform.formats.registry import motion_formats
from odeform.models.base import Predictor
from odeform_viz.columns import Column, truth_column
from odeform_viz.recording.reader import read_recording

pytestmark = [pytest.mark.slow, needs_chromium]


@pytest.fixture(scope="module")
def tab(drop: Predictor) -> Iterator[Tab]:
    """A model beside a truth of the same parameters, on the tab of downloads."""
    truth = truth_column(f"mass-elastic/{open_dataset('mass-elastic').select('test')[0].name}")
    model = Column("odeform", drop, drop.rest, origin="mass-elastic")
    for tab in open_tab(model, truth, accept_downloads=True):
        tab.app.page.pause_at(0.3)
        tab.turn_to("Record")
        yield tab


def _saved(tab: Tab, button: str, folder: Path) -> Path:
    with tab.page.expect_download() as found:
        tab.button(button).click()
    path = folder / found.value.suggested_filename
    found.value.save_as(path)
    return path


def _exported(tab: Tab, label: str, folder: Path) -> Path:
    tab.choose("format", label)
    return _saved(tab, "Download", folder)


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".glb"])
def test_shapes(tab: Tab, drop: Predictor, suffix: str, tmp_path: Path) -> None:
    mesh = trimesh.load(_exported(tab, f"current frame ({suffix})", tmp_path), process=False, force="mesh")
    request = tab.app.request()
    expected = tab.app.session.motion(request.columns[0], request).vertices(0.3)
    if suffix == ".glb":  # y points up in glTF, by its specification
        expected = expected[:, [0, 2, 1]] * [1.0, 1.0, -1.0]
    found = np.asarray(mesh.vertices)  # pyright: ignore[reportAttributeAccessIssue]
    # readers split vertices at seams, so each is compared with its nearest
    off = np.linalg.norm(found[:, None] - expected[None], axis=2)
    assert max(off.min(axis=0).max(), off.min(axis=1).max()) < 1e-5


@pytest.mark.parametrize("suffix", [".npz", ".csv", ".rrd", ".glb", ".html"])
def test_whole_motions(tab: Tab, drop: Predictor, suffix: str, tmp_path: Path) -> None:
    assert suffix in motion_formats()
    path = _exported(tab, f"whole motion ({suffix})", tmp_path)
    count = len(drop.schema.window.times)
    if suffix == ".npz":
        request = tab.app.request()
        motion = tab.app.session.motion(request.columns[0], request)
        with np.load(path, allow_pickle=False) as arrays:
            np.testing.assert_allclose(arrays["vertices"], motion.vertices(arrays["times"]), rtol=0.0, atol=1e-5)
    elif suffix == ".csv":
        rows = list(csv.DictReader(io.StringIO(path.read_text())))
        assert len(rows) == count
        assert set(ERRORS) <= set(rows[0])
        assert float(rows[-1]["error_rmse_mm"]) > 0.0
    elif suffix == ".rrd":
        assert read_recording(path).frames == count
    elif suffix == ".glb":
        assert trimesh.load(path) is not None
        assert b'"animations"' in path.read_bytes()
    else:
        browser = tab.page.context.browser
        assert browser is not None
        other = browser.new_page(viewport=VIEW)
        requests: list[str] = []
        other.on("request", lambda request: requests.append(request.url))
        other.goto(path.as_uri())
        other.wait_for_selector("canvas", timeout=1e3 * PATIENCE)
        shot = np.zeros(0)

        def drawn() -> bool:
            nonlocal shot
            shot = np.asarray(Image.open(io.BytesIO(other.screenshot(timeout=1e3 * PATIENCE))).convert("RGB"))
            return bool(shot[120:360, 200:600].std() > 3.0)

        assert until(drawn)
        Image.fromarray(shot).save(tmp_path / "html.png")
        assert not [url for url in requests if url.startswith(("http", "ws"))]
        other.close()


def test_a_screenshot(tab: Tab, tmp_path: Path) -> None:
    with Image.open(_saved(tab, "Screenshot (.png)", tmp_path)) as picture:
        assert picture.format == "PNG"
        assert picture.size[1] > 150  # what plots and timeline leave of a low window
        assert np.asarray(picture.convert("RGB")).std() > 3.0


def test_a_film_has_frames_that_differ_and_the_time_returns(tab: Tab, tmp_path: Path) -> None:
    with Image.open(_saved(tab, "Film (.webp)", tmp_path)) as film:
        assert film.format == "WEBP"
        assert film.n_frames > 10  # pyright: ignore[reportAttributeAccessIssue]
        frames = []
        for index in (0, film.n_frames // 4, film.n_frames // 2):  # pyright: ignore[reportAttributeAccessIssue]
            film.seek(index)
            frames.append(np.asarray(film.convert("RGB")).astype(int))
    assert all((np.abs(one - two).max(axis=2) > 24).any() for one, two in pairwise(frames))
    assert until(lambda: tab.app.clock.time() == 0.3)


def test_a_film_can_be_cancelled(tab: Tab) -> None:
    downloads: list[object] = []
    tab.page.on("download", lambda download: downloads.append(download))
    tab.button("Film (.webp)").click()
    tab.button("Cancel the film").click()
    assert until(lambda: tab.button("Film (.webp)").is_visible())
    assert tab.app.clock.time() == 0.3
    assert not downloads
