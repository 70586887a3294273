"""One network for several bodies in the viewer's session, beside another model."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from few_pushes import few_pushes

from odeform.checkpoint import Checkpoint
from odeform.dataset.store import open_dataset
from odeform.models.layers import layer_shapes
from odeform.models.points.point_model import PREFIX
from odeform.models.points.shape_inputs import Ranges
from odeform.models.points.shape_model import ShapeModel
from odeform.models.registry import load
from odeform.motion.recorded import RecordedMotion
from odeform.simulation.objects.catalog import get_object
from odeform_viz.columns import Column, Columns
from odeform_viz.session import Session
from odeform_viz.view import ViewRequest

BODIES = ("chip", "donut")


@pytest.fixture(scope="module")
def model() -> ShapeModel:
    """An untrained one."""
    rng, schema = np.random.default_rng(0), open_dataset("contact-force").schema
    shapes = layer_shapes(ShapeModel.network.sizes(128))
    arrays = {PREFIX + name: rng.normal(size=shape, scale=0.05).astype(np.float32) for name, shape in shapes}
    items = {name: get_object(name) for name in BODIES}
    for name, item in items.items():
        rest = item.rest_mesh()
        arrays |= {f"{name}/rest.points": rest.points, f"{name}/rest.faces": rest.faces}
    arrays |= {f"rest.{key}": arrays[f"{BODIES[0]}/rest.{key}"] for key in ("points", "faces")}
    bodies = {name: {"mass": item.mass, "young": item.material.young} for name, item in items.items()}
    ranges = Ranges((-1.0,) * 9, (1.0,) * 9, 0.1, 0.02, 1.0, 3.0)
    config = {"width": 128, "ranges": asdict(ranges), "bodies": bodies}
    return ShapeModel(Checkpoint("odeform-shapes", replace(schema, objects=BODIES), config, arrays))


@pytest.mark.parametrize("name", BODIES)
def test_beside_another_model_and_the_truth(model: ShapeModel, name: str) -> None:
    data, other = few_pushes(*BODIES), load("contact-force/nearest")
    truth = RecordedMotion(data.schema, next(data.sequences("test", name)))
    models = {"network": model, "nearest": other}
    shown = [Column(label, each, each.rest_of({"object": name})) for label, each in models.items()]
    session = Session(model.schema)
    columns = Columns.of([Column("truth", truth, truth.geometry), *shown]).all
    frame = session.frame(ViewRequest(session.schema.complete(truth.parameters), 0.1, "balanced", columns))
    assert not frame.refused
    network = next(column for column in frame.columns if column.column.label == "network")
    assert network.stats.status == "ok"
    assert network.error is not None
