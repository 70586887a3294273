"""Which axis is taken for up."""

import numpy as np
import pytest
import trimesh

from odeform.geometry.upright import guess_up
from odeform.types import Mesh


def _table() -> trimesh.Trimesh:
    """Four legs under a plate, z up."""
    legs = [
        trimesh.creation.box([0.1, 0.1, 0.8], trimesh.transformations.translation_matrix([x, y, 0.4]))
        for x in (-0.5, 0.5)
        for y in (-0.2, 0.2)
    ]
    plate = trimesh.creation.box([1.1, 0.7, 0.1], trimesh.transformations.translation_matrix([0.0, 0.0, 0.85]))
    return trimesh.util.concatenate([*legs, plate])


@pytest.mark.parametrize(("up", "turn"), [("+z", 0.0), ("+y", -0.5 * np.pi)])
def test_a_table_stands_on_its_legs(up: str, turn: float) -> None:
    table = _table().apply_transform(trimesh.transformations.rotation_matrix(turn, [1.0, 0.0, 0.0]))
    assert guess_up(Mesh(table.vertices.astype(np.float32), np.asarray(table.faces))) == up


def test_a_ball_stays_as_it_is() -> None:
    ball = trimesh.creation.icosphere(3)
    assert guess_up(Mesh(ball.vertices.astype(np.float32), np.asarray(ball.faces))) == "+z"
