"""Which columns stand side by side."""

from dataclasses import replace

import pytest

from odeform import InputError
from odeform.dataset.index import Dataset
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.motion.recorded import RecordedMotion
from odeform_viz.columns import MOST, Column, Columns
from odeform_viz.panels.compare import sweep


class Foreign:
    """As much of a model as columns look at, under another schema."""

    def __init__(self, like: Predictor, **changes: object) -> None:
        self.schema = replace(like.schema, **changes)  # pyright: ignore[reportArgumentType]


def _column(kick: Predictor) -> Column:
    return Column("odeform", kick, kick.rest)


def test_another_scene_is_refused(kick: Predictor) -> None:
    other = Column("foreign", Foreign(kick, scene="mass-elastic"), kick.rest)  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="mass-elastic"):
        Columns.of([_column(kick), other])


def test_a_model_that_lacks_a_parameter_says_so(kick: Predictor) -> None:
    fewer = Foreign(kick, parameters=tuple(p for p in kick.schema.parameters if p.name != "bending"))
    columns = Columns.of([_column(kick), Column("plain", fewer, kick.rest)])  # pyright: ignore[reportArgumentType]
    assert columns.all[1].label == "plain (no bending)"


def test_what_a_model_lacks_is_called_as_its_slider() -> None:
    pushed, gp = load("contact-force"), load("contact-force/gp")
    columns = Columns.of([_column(pushed), Column("gp", gp, gp.rest)])
    assert columns.all[1].label == "gp (no mass, stiffness)"


def test_labels_and_keys_are_distinct_and_last(kick: Predictor) -> None:
    columns = Columns.of([_column(kick)] * 3)
    assert [c.label for c in columns.all] == ["odeform", "odeform #2", "odeform #3"]
    keys = [c.key for c in columns.all]
    columns.set_visible(keys[1], False)
    assert [c.key for c in columns.all] == keys
    assert [c.visible for c in columns.all] == [True, False, True]
    columns.remove(keys[0])
    assert [c.key for c in columns.all] == keys[1:]


def test_there_is_one_truth(kick: Predictor, dataset: Dataset) -> None:
    columns = Columns.of([_column(kick)])
    for sequence in list(dataset.sequences("test"))[:2]:
        record = RecordedMotion(kick.schema, sequence)
        columns.add(Column("truth", record, record.geometry))
    assert [c.truth is not None for c in columns.all] == [False, True]
    last = columns.all[-1].truth
    assert last is not None
    assert last.sequence is sequence


def test_a_sweep_covers_the_trained_range(kick: Predictor) -> None:
    mass = kick.schema.parameters[0]
    swept = sweep(_column(kick), kick.schema.complete({"force": 130.0}), kick.schema, "mass")
    values = [c.pinned["mass"] for c in swept if c.pinned]
    assert values[0] == pytest.approx(mass.low)
    assert values[-1] == pytest.approx(mass.high)
    assert all(c.pinned is not None and c.pinned["force"] == 130.0 for c in swept)


def test_too_many_are_refused_and_nothing_is_lost(kick: Predictor) -> None:
    columns = Columns.of([_column(kick)] * MOST)
    with pytest.raises(InputError, match=str(MOST)):
        columns.add(_column(kick))
    assert len(columns.all) == MOST
