"""The map of stability, made when asked for."""

import numpy as np
import pytest

from odeform_viz.app import App
from odeform_viz.benchmark.client import LoopbackClient
from odeform_viz.panels import stability
from odeform_viz.runtime.jobs import Report


def small(report: Report, checkpoint: str) -> np.ndarray:
    assert checkpoint == "kick"
    return np.zeros((4, 6, 3), dtype=np.uint8)


def broken(report: Report, checkpoint: str) -> np.ndarray:
    raise RuntimeError("no such model")


@pytest.mark.parametrize(("work", "shown"), [(small, True), (broken, False)])
def test_a_picture_or_why_there_is_none(kicked: tuple[App, LoopbackClient], work, shown: bool) -> None:
    app, client = kicked
    panel = app._stability
    assert isinstance(panel, stability.StabilityPanel)
    panel._job.work = work
    assert not panel._picture.visible
    client.click("Map stability")
    assert client.until(lambda: not panel._job.running and (panel._picture.visible or "No map" in panel._text.content))
    assert panel._picture.visible == shown
    assert panel._button.visible != shown
    assert "no such model" in panel._text.content or shown
