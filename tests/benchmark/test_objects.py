"""The benchmark of a model of several pushed objects."""

from dataclasses import replace

import pytest

from odeform.benchmark import objects
from odeform.benchmark.objects import bench_objects
from odeform.benchmark.report import report
from odeform.checkpoint import Checkpoint
from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.models.per_object import PerObject
from odeform.models.registry import load

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def donut() -> PerObject:
    """The bundled model, of one object."""
    found = load("contact-force")
    assert isinstance(found, PerObject)
    checkpoint: Checkpoint = found.checkpoint
    return PerObject(
        replace(checkpoint, schema=replace(checkpoint.schema, objects=("donut",))), type(found.parts["donut"])
    )


def test_each_object_has_a_row_for_each_quality(donut: PerObject, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(objects, "SEQUENCES", 2)
    result = bench_objects(donut, open_dataset("contact-force"))
    rows = {row["quality"]: row for row in result["qualities"]}
    assert list(rows) == ["draft", "balanced", "reference"]
    assert rows["draft"]["steps"] < rows["balanced"]["steps"] < rows["reference"]["steps"]
    assert rows["draft"]["solver_error_mm"] > rows["balanced"]["solver_error_mm"] > rows["reference"]["solver_error_mm"]
    assert rows["balanced"]["solver_error_mm"] < rows["balanced"]["model_error_mm"]
    (simulated,) = result["simulator"]
    assert simulated["speedup"] > 10.0
    machine = {"cores": 2, "processor": "x", "load": 0.0}
    whole = {"machine": machine, "model": donut.model, "scene": "contact-force", "data": "contact-force"}
    text = report({**whole, "objects": result})
    assert "solver_error_mm" in text
    assert "simulator_s" in text


def test_it_needs_data(donut: PerObject) -> None:
    with pytest.raises(InputError, match="expected a data set"):
        bench_objects(donut, None)
