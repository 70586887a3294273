"""Rivals of the field: coarser models of an object, and the plot of their errors."""

import xml.etree.ElementTree as Xml

import numpy as np
import pytest

from odeform.simulation.objects.catalog import get_object
from odeform_figures.speed.rivals import caged, coarser, drawn
from odeform_figures.speed.scatter import scatter

SVG = "{http://www.w3.org/2000/svg}"


def test_nodes_of_a_cage_carry_the_surface_where_it_is() -> None:
    cages = (("donut", "trilinear", 1, 8), ("donut", "trilinear", 2, 27), ("donut", "quadratic", 1, 27))
    empty = ("bottle", "trilinear", 4, 121)  # four of its nodes have no cell
    for name, order, cells, nodes in (*cages, empty):
        item = get_object(name)
        rival = caged(item, order, cells)
        assert rival.nodes == nodes
        assert rival.carries.sum(axis=1) == pytest.approx(1.0, abs=1e-9)
        body = rival.make(1e-3, "")
        assert np.abs(rival.carries @ body.positions - item.points[: item.surface_count]).max() < 1e-6


@pytest.mark.slow
def test_a_coarser_mesh_carries_the_surface_where_it_is() -> None:
    item = get_object("donut")
    rival = coarser(item, 800)
    assert rival.nodes < 0.7 * len(item.points)
    places = rival.carries @ rival.make(1e-3, "").positions
    assert np.abs(places - item.points[: item.surface_count]).max() < 1e-9


def test_points_stand_where_time_and_error_are() -> None:
    """Farther right is slower, and farther up is worse; what failed is left out."""
    rows = [
        {"object": "donut", "kind": "fast", "ms": 1.0, "error_mm": 2.0},
        {"object": "donut", "kind": "slow", "ms": 100.0, "error_mm": 0.02},
        {"object": "donut", "kind": "slow", "failed": "not converged"},
    ]
    root = Xml.fromstring(drawn(rows))
    (panel,) = root.findall(f"{SVG}g")
    (fast, slow) = [(float(c.attrib["cx"]), float(c.attrib["cy"])) for c in panel.findall(f"{SVG}circle")]
    assert fast[0] < slow[0]
    assert fast[1] < slow[1]  # y points down
    labels = [text.text for text in root.iter(f"{SVG}text")]
    assert {"donut", "fast", "slow", "1", "100"} <= set(labels)


def test_a_plot_of_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="at least one point"):
        scatter({"donut": {}}, "ms", "mm")
