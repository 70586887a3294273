"""Small caches."""

import gc
import weakref

import numpy as np
import pytest

import odeform
from odeform.motion.recent import InUse, Recent
from odeform.types import Mesh


class _Value:
    pass


def test_the_last_few_are_kept() -> None:
    cache = Recent[int](2)
    made = []

    def get(key: str) -> int:
        return cache.get(key, lambda: made.append(key) or len(made))

    assert [get("a"), get("b"), get("a"), get("c"), get("a"), get("b")] == [1, 2, 1, 3, 1, 4]


def test_what_is_in_use_is_kept_and_the_last_one() -> None:
    cache = InUse[_Value]()
    used, last = cache.get("used", _Value), weakref.ref(cache.get("last", _Value))
    gc.collect()
    assert cache.get("last", _Value) is last()
    assert cache.get("used", _Value) is used
    gc.collect()
    assert last() is None


def test_a_model_forgets_shapes_that_nothing_shows() -> None:
    model = odeform.load("kick/gp")
    shapes = [Mesh(np.asarray(model.rest.points) * scale, model.rest.faces) for scale in (1.0, 0.9, 0.8)]
    alive = [weakref.ref(shape) for shape in shapes]
    shown = model.solve(shapes.pop(0))
    while shapes:
        model.solve(shapes.pop(0))
    gc.collect()
    assert [shape() is not None for shape in alive] == [True, False, True]
    assert np.isfinite(shown.vertices(0.1)).all()


@pytest.mark.parametrize("name", ["mass-elastic", "contact-force"])
def test_a_shape_that_was_changed_in_place_moves_as_it_is_now(name: str) -> None:
    predictor = odeform.load(name)
    mesh = Mesh(predictor.rest.points.copy(), predictor.rest.faces)
    first = predictor.solve(mesh, until=0.1)
    before = first.vertices(0.1).copy()
    assert not first.untrained
    mesh.points[:] += np.float32([0.01, 0.0, 0.05])
    again, other = predictor.solve(mesh, until=0.1), predictor.solve(Mesh(mesh.points.copy(), mesh.faces), until=0.1)
    np.testing.assert_array_equal(again.vertices(0.1), other.vertices(0.1))
    np.testing.assert_array_equal(again.vertices(0.0), mesh.points)
    assert again.untrained == other.untrained
    np.testing.assert_array_equal(first.vertices(0.1), before)
