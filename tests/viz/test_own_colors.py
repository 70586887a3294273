"""The truth of a user's own body in the colours of the shape."""

from dataclasses import replace

import numpy as np

from odeform.geometry.shape import FittedShape
from odeform.geometry.similarity import Similarity
from odeform.models.modal.elastic_body import elastic_body
from odeform.models.registry import load
from odeform.types import Mesh
from odeform_viz.user_bodies import UserBody, UserBodyPredictor, with_own_colors
from tests.soft_block import block_object


def test_the_simulators_surface_has_the_colours_of_the_shape() -> None:
    item = block_object()
    rest = item.rest_mesh()
    colors = np.tile(np.array([250, 20, 30], np.uint8), (len(rest.faces), 3, 1))
    fit = FittedShape(rest, None, Similarity(), replace(rest, colors=colors), None, 0.0)
    model = UserBodyPredictor(load("contact-force"), UserBody(item, elastic_body(item, 60), "pillow", fit))
    simulated = Mesh(rest.points, rest.faces)
    assert np.array_equal(with_own_colors(simulated, model).colors, colors)
    other = Mesh(rest.points, rest.faces[:-1])
    assert with_own_colors(other, model) is other, "a recording of another body"
    assert with_own_colors(simulated, load("contact-force")) is simulated
