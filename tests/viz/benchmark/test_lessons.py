"""The benchmark of a shape that is taught while its slider is dragged."""

import numpy as np
import trimesh

from odeform_figures.viewer_benchmark.lessons import _positions
from odeform_viz.rendering.glb import GlbWriter


def test_the_points_of_a_coloured_body_are_read_from_what_the_page_sends() -> None:
    ball = trimesh.creation.icosphere(subdivisions=1)
    points = ball.vertices.astype(np.float32)
    data = GlbWriter(len(points), ball.faces, 2.0, None, False).write(points, np.zeros((len(points), 3), np.uint8))
    assert np.array_equal(_positions(data), points)
