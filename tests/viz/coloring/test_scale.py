"""The color scale fits what is shown."""

import numpy as np

from odeform_viz.coloring.scale import TABLE, ScaleFitter, colors_of
from odeform_viz.view import ColorScale


def test_the_scale_is_round_and_mostly_used() -> None:
    for largest in (0.013, 0.21, 0.43, 1.01, 7.9, 33.0, 130.0):
        scale = ScaleFitter().fit("error", largest)
        assert largest <= scale.top <= 1.5 * largest
        assert float(f"{scale.top:.2g}") == scale.top
        assert scale.unit == "mm"


def test_small_changes_leave_the_scale_as_it_is() -> None:
    fitter = ScaleFitter()
    first = fitter.fit("strain", 9.0)
    assert fitter.fit("strain", 5.5) is first
    assert fitter.fit("strain", 12.0).top == 15.0
    assert fitter.fit("strain", 1.0).top == 1.0
    assert fitter.fit("displacement", 1.0).quantity == "displacement"
    assert fitter.fit("displacement", 0.0).top > 0.0


def test_the_scale_of_a_motion_stays_whatever_the_moment() -> None:
    fitter = ScaleFitter()
    assert fitter.fixed("error") is None
    scale = fitter.fit("error", 13.0, momentary=False)
    assert scale.top == 15.0
    assert fitter.fixed("error") is scale
    assert fitter.fixed("strain") is None
    assert fitter.fit("error", 14.0) is not scale  # of a moment
    assert fitter.fixed("error") is None


def test_colors_run_from_one_end_to_the_other() -> None:
    colors = colors_of(np.array([0.0, 5.0, 10.0, 100.0]), ColorScale("error", "mm", 10.0))
    np.testing.assert_array_equal(colors, TABLE[[0, 127, 255, 255]])
    assert len(np.unique(TABLE, axis=0)) > 200  # no bands that one could see
