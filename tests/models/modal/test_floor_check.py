"""The check of the floor finds the lowest vertex of a body that is deformed, or of another mass and stiffness."""

from collections.abc import Mapping

import numpy as np
import pytest

import odeform
from odeform.dataset.store import open_dataset
from odeform.models.modal.model import ModalModel
from odeform.models.per_object import PerObject

LIMIT, SPARE = 5e-3, 5e-5  # m that a body may be shown below the floor, and what rounding adds
TIMES = np.linspace(0.01, 0.6, 60)
# found by stress: a leg of a heavy and soft dog, a corner of a pillow, the tail of a cat, a strap that is pushed down
PUSHES = (
    {
        "object": "dog",
        "contact": (0.1982, -0.0246, 0.2096),
        "force": (-3.82, 22.942, -2.4478),
        "mass": 2.6583,
        "young": 56.2465,
    },
    {
        "object": "pillow",
        "contact": (0.1709, -0.1338, 0.069),
        "force": (-0.398, 0.4379, -3.315),
        "mass": 0.4476,
        "young": 7.7197,
    },
    {
        "object": "cat",
        "contact": (0.0037, -0.0094, 0.1819),
        "force": (7.9128, 4.4488, 1.9172),
        "mass": 0.6113,
        "young": 108.799,
    },
    {
        "object": "flip-flop",
        "contact": (0.0184, -0.0304, 0.0696),
        "force": (3.4421, -0.3134, -4.7077),
        "mass": 0.1931,
        "young": 172.9946,
    },
)


@pytest.fixture(scope="module")
def predictor() -> PerObject:
    found = odeform.load("contact-force")
    assert isinstance(found, PerObject)
    return found


@pytest.mark.parametrize("push", PUSHES, ids=[str(push["object"]) for push in PUSHES])
def test_no_vertex_is_shown_deeper_than_the_limit(predictor: PerObject, push: Mapping[str, object]) -> None:
    vectors = {f"{name}_{axis}": x for name in ("contact", "force") for axis, x in zip("xyz", push[name], strict=True)}  # pyright: ignore[reportArgumentType]
    parameters = {key: value for key, value in push.items() if key not in ("contact", "force")} | vectors
    lowest = predictor.solve(parameters=parameters).vertices(TIMES)[:, :, 2].min()
    assert lowest > -LIMIT - SPARE


def test_a_body_rests_nearly_as_deep_as_it_stands_also_where_it_has_fallen_over(predictor: PerObject) -> None:
    stands = float(predictor.rest_of({"object": "dog"}).points[:, 2].min())
    times, deepest = np.array([0.19, 0.4, 0.8, 1.5]), []
    for truth in open_dataset("contact-force").sequences("test", "dog"):
        deepest.append(predictor.solve(parameters=truth.parameters).vertices(times)[:, :, 2].min(axis=1))
    in_window, *later = np.min(deepest, axis=0)
    assert in_window < -3.5e-3, "a leg under load sinks"
    assert min(later) > stands - 1e-3 - SPARE


def test_a_heavy_soft_body_begins_where_it_rests_however_deep_that_is(predictor: PerObject) -> None:
    body = {"mass": 2.6246, "young": 51.788}  # a dog of twice its mass and half its stiffness
    push = predictor.complete({"object": "dog", **body})
    first, settled = predictor.solve(parameters=push).vertices(0.0), predictor.settled(push).points
    assert settled[:, 2].min() < 1e-3 - LIMIT, "deeper than pushed bodies are shown"
    np.testing.assert_array_equal(first, settled)


def test_few_points_are_nearly_as_low_as_all(predictor: PerObject) -> None:
    for name in predictor.schema.objects:
        part = predictor.parts[name]
        assert isinstance(part, ModalModel)
        body = part.checked_body
        directions = np.random.default_rng(3).normal(size=(400, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        every, few = ((each.rest.astype(float) @ directions.T).min(axis=0) for each in (body.all, body.few))
        assert (few - every).max() < 3e-3, name
        assert len(body.few.rest) < 0.5 * len(body.all.rest)


def test_under_loads_a_heavy_and_soft_body_is_shown_as_flat_as_its_own_self(predictor: PerObject) -> None:
    heavy, times = {"object": "dog", "mass": 2.6583, "young": 56.2465}, np.linspace(0.0, 1.2, 40)
    assert predictor.settled(heavy).points[:, 2].min() < -3e-3, "its springs to the floor give way"
    for load, more in (("drop", {"height": 0.1}), ("kick", {})):
        model = predictor.under(load)
        motion = model.solve(parameters=heavy | more)
        assert motion.vertices(times)[:, :, 2].min() > -1e-3 - 1e-6
        if load == "kick":
            np.testing.assert_array_equal(motion.vertices(0.0), model.settled(heavy | more).points)
