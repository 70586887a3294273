"""Walls, steps and slopes in the viewport and in recordings."""

import numpy as np
import pytest
import viser

from odeform.loads.registry import get_load
from odeform.motion.recorded import RecordedMotion
from odeform.simulation.scenes.registry import get_scene
from odeform.types import MotionSequence
from odeform_viz.rendering.obstacles import ObstacleView


def motion(load: str, **values: float) -> RecordedMotion:
    schema, points = get_scene(f"object-{load}").schema, np.eye(3, dtype=np.float32)
    faces, weights = np.array([[0, 1, 2]], dtype=np.int32), np.full(3, 1.0 / 3.0)
    parameters = {**schema.complete({"object": "donut"}), **values}
    return RecordedMotion(
        schema, MotionSequence(np.array([0.0, 0.1]), np.stack([points] * 2), faces, weights, parameters)
    )


@pytest.mark.parametrize("load", ["wall", "step", "slope"])
def test_what_is_drawn_is_where_the_body_meets_it(server: viser.ViserServer, load: str) -> None:
    view, shown = ObstacleView(server, "/ground"), motion(load, distance=0.4)
    view.show(shown)
    node = server.scene.get_handle_by_name("/ground/obstacle_0")
    assert isinstance(node, viser.MeshHandle)
    (obstacle,) = get_load(load).obstacles(shown.parameters)
    gaps = obstacle.met(np.asarray(node.vertices, dtype=float))[0]
    assert (np.abs(gaps) < 1e-6).any()
    assert gaps.max() < 1e-6


def test_it_follows_the_parameters_and_goes_with_the_load(server: viser.ViserServer) -> None:
    view = ObstacleView(server, "/ground")
    nearest = []
    for distance in (0.3, 0.5):
        view.show(motion("wall", distance=distance))
        node = server.scene.get_handle_by_name("/ground/obstacle_0")
        assert isinstance(node, viser.MeshHandle)
        nearest.append(float(node.vertices[:, 0].min()))
    np.testing.assert_allclose(nearest, [0.3, 0.5], atol=1e-6)
    view.show(motion("throw"))
    assert server.scene.get_handle_by_name("/ground/obstacle_0") is None
