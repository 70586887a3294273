"""Stored motions of objects belong to the object's own mass and stiffness."""

import pytest

import odeform
from odeform.simulation.recorded import read_truth
from odeform_viz.columns import Column, Columns, truth_column


def test_a_stored_push_is_that_of_the_objects_own_mass_and_stiffness() -> None:
    entry = odeform.open_dataset("contact-force").of("pillow").select("test")[0]
    truth = read_truth(f"contact-force/{entry.name}")
    model = odeform.load("contact-force")
    own = model.complete({**entry.parameters, "object": "pillow"})
    assert (truth.setting["mass"], truth.setting["young"]) == pytest.approx((own["mass"], own["young"]))
    assert truth.of(own)
    assert not truth.of({**own, "mass": 1.5 * own["mass"]})
    assert not truth.of({**own, "young": 0.7 * own["young"]})


def test_beside_a_model_it_misses_no_parameter() -> None:
    entry = odeform.open_dataset("contact-force").of("pillow").select("test")[0]
    model = odeform.load("contact-force")
    columns = Columns.of([Column("modal", model, model.rest), truth_column(f"contact-force/{entry.name}")])
    assert [column.label for column in columns.all] == ["modal", "truth"]
