"""Axes of the scene in a corner of the view, where sliders name them."""

from collections.abc import Iterator

import numpy as np
import pytest
from browsing import VIEW, Tab, needs_chromium, open_tab, until
from viser.transforms import SO3

import odeform
from odeform_viz.columns import Column
from odeform_viz.panels.axes import axes_script, names_axes


@pytest.mark.parametrize(
    ("name", "named"), [("contact-force:throw", True), ("contact-force:wall", True), ("kick", True),
                        ("contact-force", False), ("mass-elastic", False)]
)  # fmt: skip
def test_axes_are_shown_where_sliders_name_them(name: str, named: bool) -> None:
    assert names_axes(odeform.load(name).schema) == named


def test_axes_are_those_that_the_camera_sees() -> None:
    along_y = SO3.from_matrix(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]))
    assert "[[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]" in axes_script(along_y), "x right, y away, z up"


@pytest.fixture
def tab() -> Iterator[Tab]:
    model = odeform.load("contact-force:throw")
    yield from open_tab(Column("throw", model, model.rest, origin="contact-force:throw"), control="velocity x (m/s)")


def _drawn(tab: Tab) -> dict[str, str]:
    """The path of each axis, by its letter."""
    groups = tab.page.locator(".odeform-axes g")
    return groups.evaluate_all(
        "all => Object.fromEntries(all.map(g => [g.textContent, g.firstChild.getAttribute('d')]))"
    )


@pytest.mark.slow
@needs_chromium
def test_axes_turn_with_the_camera_and_go_with_their_scene(tab: Tab) -> None:
    assert until(lambda: set(_drawn(tab)) == {"x", "y", "z"})
    assert until(lambda: _drawn(tab)["z"].partition("L")[2].split()[1].startswith("-")), "z is up"
    before = _drawn(tab)
    mouse = tab.page.mouse
    mouse.move(0.3 * VIEW["width"], 0.35 * VIEW["height"])
    mouse.down()
    mouse.move(0.5 * VIEW["width"], 0.35 * VIEW["height"], steps=5)
    mouse.up()
    assert until(lambda: _drawn(tab)["x"] != before["x"])
    tab.app.show_load("push")
    assert until(lambda: not _drawn(tab))
    assert tab.says("straight into the surface")
    tab.app.show_load("drop")
    assert until(lambda: set(_drawn(tab)) == {"x", "y", "z"})
    assert tab.errors == []
