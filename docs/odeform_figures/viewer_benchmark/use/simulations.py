"""Simulations: one that is cancelled, and one whose browser closes, which the others see."""

from odeform_figures.viewer_benchmark.visitors import Visitors

__all__ = ["simulate"]

START, CANCEL, LONGEST = "Simulate this", "Cancel", 300.0  # s, for a busy machine


def simulate(visitors: Visitors) -> None:
    """Simulate the parameters of the sliders; see the description of this module."""
    app, client = visitors.app, visitors.first
    client.click(START)
    visitors.expect_control(CANCEL)
    visitors.second.click(CANCEL)
    visitors.expect_control(START)
    before = app.columns.truth
    with visitors.another() as other:
        other.click(START)
        visitors.expect_control(CANCEL)
        visitors.drag(client, 20)
    visitors.expect("a simulated truth", lambda: app.columns.truth not in (None, before), LONGEST)
    visitors.expect_control(START)
    visitors.drag(visitors.second, 10)
    visitors.expect_control("Set sliders to the truth")
    client.click("Set sliders to the truth")
    visitors.expect("errors against the truth", lambda: "error now:" in client.text())
