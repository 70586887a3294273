"""The map of stability, made when asked for."""

import threading

import numpy as np
import pytest

from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.panels.stability import StabilityPanel
from odeform_viz.runtime.jobs import Report


def small(report: Report, checkpoint: str) -> np.ndarray:
    assert checkpoint == "kick"
    return np.zeros((4, 6, 3), dtype=np.uint8)


def broken(report: Report, checkpoint: str) -> np.ndarray:
    raise RuntimeError("no such model")


@pytest.mark.parametrize(("work", "shown"), [(small, True), (broken, False)])
def test_an_image_or_why_there_is_none(kicked: tuple[App, LoopbackClient], work, shown: bool) -> None:
    app, client = kicked
    panel = app.panel(StabilityPanel)
    panel._work = work
    assert not panel._image.visible
    client.click("Map stability")
    assert client.until(lambda: panel._image.visible or "The map failed" in panel._text.content)
    assert panel._image.visible == shown
    assert panel._button.visible != shown
    assert "no such model" in panel._text.content or shown


def endless(report: Report, checkpoint: str) -> np.ndarray:
    report(0.25)
    threading.Event().wait()
    raise AssertionError


def test_a_map_shows_its_progress_and_can_be_cancelled(kicked: tuple[App, LoopbackClient]) -> None:
    app, client = kicked
    panel = app.panel(StabilityPanel)
    panel._work = endless
    client.click("Map stability")
    assert client.until(lambda: panel._bar.visible and panel._bar.value == 25.0)
    client.click("Cancel the map")
    assert client.until(lambda: panel._button.visible and not panel._bar.visible)
    assert panel._job is not None
    assert not panel._job.running
    panel._work = small
    client.click("Map stability")
    assert client.until(lambda: panel._image.visible)
