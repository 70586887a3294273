"""Fits: of a browser that closes in the middle, taken to the sliders, left for another truth, and cancelled."""

from odeform_figures.viewer_benchmark.visitors import Visitors
from odeform_viz.panels.truth import NONE

__all__ = ["choose_truth", "fit"]

START, CANCEL, USE = "Fit to the truth", "Cancel the fit", "Set sliders to the estimate"
DONE, STEP = "Mean square difference", "of what is expected: "  # in the text of the panel


def fit(visitors: Visitors) -> None:
    """Fit a test sequence; see the description of this module."""
    app, client = visitors.app, visitors.first
    choose_truth(visitors)
    with visitors.another() as other:
        other.click(START)
        visitors.expect_control(CANCEL)
    visitors.drag(visitors.second, 20)
    visitors.expect("the estimates of a fit", lambda: all(DONE in c.text() for c in visitors.clients))
    visitors.expect_control(USE)
    client.click(USE)
    estimate = next(c.pinned for c in reversed(app.columns.all) if c.pinned is not None)
    visitors.expect("sliders at the estimate", lambda: _near(app.request().parameters, estimate))
    for leave in (lambda: choose_truth(visitors), lambda: visitors.second.click(CANCEL)):
        visitors.expect_control(START)
        client.click(START)
        visitors.expect("steps of a fit", lambda: STEP in client.text())
        leave()
        visitors.expect("no text of a fit", lambda: not any(s in client.text() for s in (STEP, DONE)))
    client.set("test sequence", NONE)


def choose_truth(visitors: Visitors) -> None:
    """Chooses another sequence than the present one."""
    control = visitors.first.controls["test sequence"]
    others = [option for option in control.props["options"] if option not in (NONE, control.value)]
    visitors.first.set("test sequence", str(visitors.rng.choice(others)))
    visitors.expect_control(START)


def _near(parameters: object, estimate: object) -> bool:
    assert isinstance(parameters, dict)
    assert isinstance(estimate, dict)
    return all(abs(parameters[name] - value) <= 1e-6 + 1e-3 * abs(value) for name, value in estimate.items())
