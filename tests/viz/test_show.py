"""The page in a notebook: a frame of it, its sliders from Python, and motions that need no server."""

from collections.abc import Iterator

import pytest

import odeform
import odeform_viz
from odeform.errors import InputError
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.notebook import NotebookPage


@pytest.fixture
def page() -> Iterator[NotebookPage]:
    shown = odeform_viz.show("mass-elastic/nearest", height=321)
    yield shown
    shown.close()


def test_a_notebook_shows_the_page_of_this_machine(page: NotebookPage) -> None:
    frame = page._repr_html_()
    assert f'<iframe src="{page.url}"' in frame
    assert 'height="321"' in frame
    assert page.url.startswith("http://127.0.0.1:")


def test_sliders_are_moved_and_read_from_python(page: NotebookPage) -> None:
    with LoopbackClient(int(page.url.rpartition(":")[2])) as client:
        page.parameters["mass"] = 0.2
        assert page.parameters["mass"] == pytest.approx(0.2)
        assert set(page.parameters) == {"mass", "bending"}
        client.set("mass (kg)", 0.3)  # as a user does
        assert client.until(lambda: page.parameters["mass"] == pytest.approx(0.3))
        page.time = 0.25
        assert page.time == 0.25
        frame = page.app.page.shown
        assert client.until(lambda: (now := frame()) is not None and now.request.parameters["mass"] == 0.3)


def test_wrong_values_are_refused_where_they_are_set(page: NotebookPage) -> None:
    with pytest.raises(InputError, match="unknown parameter 'weight'"):
        page.parameters["weight"] = 1.0
    with pytest.raises(InputError, match="mass: expected a positive number"):
        page.parameters["mass"] = -1.0
    with pytest.raises(InputError, match="expected a predictor"):
        odeform_viz.show()


def test_a_motion_is_embedded_without_a_server() -> None:
    motion = odeform.load("mass-elastic/nearest").solve()
    player = odeform_viz.embed(motion, times=[0.0, 0.1], height=200)
    assert "ball, dropped" in player.html
    assert 'srcdoc="&lt;!' in player._repr_html_()
