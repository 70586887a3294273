"""What is written below the timeline."""

import re

import numpy as np
import pytest

from odeform.schema import Window
from odeform_viz.panels.timeline import Marks, timeline_html
from odeform_viz.view import Curves, shown_until

TIMES = np.linspace(0.0, 1.0, 11)
CURVES = Curves(TIMES, TIMES, TIMES, TIMES, None, None)
WINDOW = Window(0.0, 0.2, 100.0, reach=4.0)


@pytest.mark.parametrize(
    ("share", "ends"),
    [(2.0, ["1 s"]), (1.0, ["1 s"]), (0.9, ["truth until 0.9 s"]), (0.6, ["truth until 0.6 s", "1 s"])],
)
def test_the_end_of_the_truth_and_that_of_the_time_are_not_written_over_each_other(
    share: float, ends: list[str]
) -> None:
    end = shown_until(WINDOW)
    assert end == pytest.approx(1.0)
    html = timeline_html(WINDOW, "slider", Marks(CURVES, truth_end=share * end), "1", True)
    labels = re.findall(r'<span class="(?:truth|last)"[^>]*>([^<]*)</span>', html)
    assert labels == ends
