"""The arrow at what holds a body."""

import numpy as np

from odeform.loads.hold import LOAD, held_vertex
from odeform.simulation.objects.catalog import get_object
from odeform.simulation.scenes.loaded import start_of
from odeform_viz.rendering.glyphs import _Attached


def test_the_arrow_touches_what_is_held_wherever_the_body_is() -> None:
    item = get_object("donut")
    rest = item.rest_mesh()
    parameters = {p.name: p.default for p in LOAD.parameters} | {"turn_x": 100.0, "turn_z": 40.0}
    start = start_of(LOAD, item, parameters)
    (arrow,) = LOAD.arrows(start, parameters)
    vertex = held_vertex(rest.points, parameters)
    assert arrow.vertex == vertex
    np.testing.assert_allclose(arrow.start + arrow.vector, start.points[vertex], atol=1e-5)
    moved = start.points - np.array([0.0, 0.0, 0.01])
    _, head = _Attached.to(rest.points, arrow).placed(1.0, moved, np.eye(4))
    np.testing.assert_allclose(head, moved[vertex], atol=1e-6)
    assert arrow.strength(100.0) == 1.0, "it is held for ever"
