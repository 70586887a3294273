"""The study of one network for all shapes, on a few pushes and steps."""

from pathlib import Path

import numpy as np
import pytest
from few_pushes import few_pushes

from odeform.checkpoint import Checkpoint
from odeform.errors import InputError
from odeform.models.points.shape_model import ShapeModel
from odeform_figures.studies.one_network import OfAnotherShape, Plan, train_each, with_left_out

pytestmark = pytest.mark.slow  # data of whole objects are read

BODIES = ("donut", "chip")


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    return Plan(tmp_path_factory.mktemp("one-network"), 1.0, 1.0, steps=2)


@pytest.fixture(scope="module")
def trained(plan: Plan) -> dict[str, Checkpoint]:
    return train_each(few_pushes(*BODIES), plan)


def test_a_network_of_all_and_one_without_each(trained: dict[str, Checkpoint]) -> None:
    assert {name: checkpoint.schema.objects for name, checkpoint in trained.items()} == {
        "": BODIES,
        "donut": ("chip",),
        "chip": ("donut",),
    }
    for name, checkpoint in trained.items():
        assert not any(key.startswith(f"{name}/") for key in checkpoint.arrays if name)
        assert f"--object {' '.join(checkpoint.schema.objects)}" in checkpoint.provenance["command"][1]
    counts = {name: len(checkpoint.arrays["training.theta"]) for name, checkpoint in trained.items()}
    assert counts == {"": 8, "donut": 4, "chip": 4}


def test_a_network_is_asked_for_what_it_has_not_seen(trained: dict[str, Checkpoint]) -> None:
    truth = next(few_pushes("chip").sequences("test"))
    moved = with_left_out(trained["chip"], "chip").solve(None, truth.parameters).vertices(0.1)
    assert moved.shape == truth.rest.points.shape
    assert np.isfinite(moved).all()
    with pytest.raises(InputError, match="there is one of that name"):
        with_left_out(trained[""], "chip")


def test_encoders_that_are_shown_another_shape_predict_otherwise(trained: dict[str, Checkpoint]) -> None:
    given = {"object": "chip"}
    own, other = (kind(trained[""]).solve(None, given).vertices(0.1) for kind in (ShapeModel, OfAnotherShape))
    assert not np.array_equal(own, other)


def test_what_is_there_is_not_trained_again(plan: Plan, trained: dict[str, Checkpoint]) -> None:
    files = {path: path.stat().st_mtime_ns for path in Path(plan.keep).iterdir()}
    again = train_each(few_pushes(*BODIES), plan)
    assert {name: found.sha256 for name, found in again.items()} == {name: one.sha256 for name, one in trained.items()}
    assert {path: path.stat().st_mtime_ns for path in Path(plan.keep).iterdir()} == files
