"""One network for all shapes: trained for a few steps on a few pushes of two bodies."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from few_pushes import few_pushes

from odeform.dataset.index import Dataset
from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.evaluation.metrics import evaluate
from odeform.geometry.rigid import rotation_from_vector, rotation_z
from odeform.models.points.arithmetic import Net, Numpy
from odeform.models.points.point_network import Trial
from odeform.models.points.shape_inputs import body_of, descriptions
from odeform.models.points.shape_model import ShapeModel
from odeform.models.points.shape_network import moved_rigidly
from odeform.models.points.training.shape_data import ShapeData, prepare_shapes
from odeform.models.points.training.shape_fit import ShapeLearner
from odeform.models.points.training.torch_arithmetic import Torch
from odeform.models.registry import load
from odeform.training.train import train
from odeform.types import GaussianSplats, Mesh, PointCloud

TIMES = np.arange(0, 20, 3) / 100.0
pytestmark = pytest.mark.slow  # data of whole objects are read

BODIES, OTHER = ("donut", "chip"), "bottle"
ROUNDING = 2e-6  # m; sums in another order round otherwise


@pytest.fixture(scope="module")
def pushes() -> Dataset:
    return few_pushes(*BODIES)


@pytest.fixture(scope="module")
def data(pushes: Dataset) -> ShapeData:
    return prepare_shapes(pushes)


@pytest.fixture(scope="module")
def model(pushes: Dataset, tmp_path_factory: pytest.TempPathFactory) -> ShapeModel:
    out = tmp_path_factory.mktemp("shapes") / "shapes.safetensors"
    trained = train(pushes, out, "odeform-shapes", steps=6, report=lambda _: None)
    assert isinstance(trained, ShapeModel)
    return trained


def learner(data: ShapeData) -> ShapeLearner:
    return ShapeLearner(ShapeModel.network, data, Trial(2e-3, 128), 0, torch.device("cpu"), None)


def longer(mesh: Mesh) -> Mesh:
    return replace(mesh, points=mesh.points * np.array([1.3, 1.0, 1.0], dtype=np.float32))


def test_one_checkpoint_serves_all_its_bodies(model: ShapeModel, pushes: Dataset) -> None:
    assert model.schema.objects == BODIES
    for name in BODIES:
        truth = next(pushes.sequences("test", name))
        assert np.array_equal(model.rest_of({"object": name}).points, truth.rest.points)
        motion = model.solve(None, truth.parameters)
        assert np.array_equal(motion.vertices(0.0), truth.rest.points), "it starts at the shape itself"
        assert np.isfinite(motion.vertices(TIMES)).all()
    scored = model.checkpoint.scores["per_object"]
    assert set(scored) == set(BODIES)
    assert all(scores["sequences"] == 1 for scores in scored.values())


def test_another_cloud_moves_otherwise(model: ShapeModel) -> None:
    """The body, the push and the points that are asked for are the same; only the rest of the cloud differs."""
    rest = model.rest_of({"object": "donut"})
    given = model.complete({"object": "donut"})
    body = body_of(rest, 0.2, 3e4)
    same, other = (model.push(body_of(shape, 0.2, 3e4), given) for shape in (rest, longer(rest)))
    for one, two, again in zip(same.first, other.first, model.push(body, given).first, strict=True):
        assert np.abs(one - two).max() > 1e-3 * np.abs(one).max()
        assert np.array_equal(one, again)
    as_it_is, stretched = (model.solve(shape, given).vertices(TIMES) - shape.points for shape in (rest, longer(rest)))
    assert np.abs(as_it_is - stretched).max() > 1e-5


def test_the_order_of_points_does_not_matter(model: ShapeModel) -> None:
    rest = model.rest_of({"object": "chip"})
    order = np.random.default_rng(0).permutation(len(rest.points))
    place = np.argsort(order)
    shuffled = Mesh(rest.points[order], place[rest.faces].astype(np.int32))
    moved, mixed = (model.solve(shape, {"object": "chip"}).vertices(TIMES) for shape in (rest, shuffled))
    assert np.abs(mixed - moved[:, order]).max() < ROUNDING


def test_a_turned_body_under_a_turned_push_moves_alike(model: ShapeModel) -> None:
    rest, turn = model.rest_of({"object": "donut"}), rotation_z(0.8)
    given = model.complete({"object": "donut"})
    turned = dict(given)
    for name in ("contact", "force"):
        vector = turn @ [given[f"{name}_{axis}"] for axis in "xyz"]
        turned |= {f"{name}_{axis}": float(value) for axis, value in zip("xyz", vector, strict=True)}
    there = replace(rest, points=(rest.points @ turn.T).astype(np.float32))
    moved, again = model.solve(rest, given).vertices(TIMES), model.solve(there, turned).vertices(TIMES)
    assert np.abs(again - moved @ turn.T).max() < 10 * ROUNDING


def test_gradients_reach_the_encoders_of_the_shape(data: ShapeData) -> None:
    one = learner(data)
    one.loss(0.5).backward()
    for branch in ("global", "local"):
        for part in ("cloud", "points", "encoder"):
            gradient = one.weights[f"{branch}.{part}.0.weight"].grad
            assert gradient is not None
            assert float(gradient.abs().max()) > 0.0, f"{branch}.{part}"


def test_what_is_left_out_is_not_in_the_training(data: ShapeData) -> None:
    kept = data.without("chip")
    assert set(kept.bodies) == set(kept.theta) == {"donut"}
    assert all(set(motions) == {"donut"} for motions in kept.motions.values())
    assert kept.ranges != data.ranges, "units and ranges are of what is left"
    assert kept.identity != data.identity
    one = learner(kept)
    points = [len(split.x) for split in (*one.train_split, *one.val_split)]
    assert points == [len(data.bodies["donut"].points)] * 2


def test_training_brings_the_error_down(data: ShapeData) -> None:
    """On training motions: there are too few for others."""
    one = learner(data.without("chip"))
    one.val_split = one.train_split
    first = one.validate()
    for step in range(20):
        one.advance(step / 20)
    assert one.validate() < first


def test_a_body_that_was_not_trained_can_be_asked_for(model: ShapeModel, tmp_path: Path) -> None:
    truth = next(few_pushes(OTHER).sequences("test"))
    wider = model.with_body(OTHER, truth.rest, 0.75, 8.3e4)
    assert wider.schema.objects == (*BODIES, OTHER)
    moved = wider.solve(None, truth.parameters).vertices(TIMES)
    assert np.isfinite(moved).all()
    assert np.abs(moved - truth.rest.points).max() > 1e-5
    assert np.array_equal(wider.solve().vertices(TIMES), model.solve().vertices(TIMES)), "others move as before"
    heavy = model.with_body(OTHER, truth.rest, 7.5, 8.3e4)
    assert not np.array_equal(heavy.solve(None, truth.parameters).vertices(TIMES), moved)
    wider.save(tmp_path / "wider.safetensors")
    assert np.array_equal(load(tmp_path / "wider.safetensors").solve(None, truth.parameters).vertices(TIMES), moved)
    with pytest.raises(InputError, match="there is one of that name"):
        wider.with_body(OTHER, truth.rest, 1.0, 1e5)
    with pytest.raises(InputError, match="positive mass and stiffness"):
        model.with_body(OTHER, truth.rest, 0.0, 1e5)


def test_training_and_prediction_see_the_same(data: ShapeData, model: ShapeModel) -> None:
    """Descriptions of a push, and the rigid motion after the deformation, in torch and in numpy."""
    motions = data.motions["train"]["donut"]
    described = data.ranges.bounded(descriptions(data.bodies["donut"], motions.contact, motions.force))
    assert described.min() >= -1.0
    assert described.max() <= 1.0
    rng = np.random.default_rng(0)
    x, shift, vector = (rng.normal(size=size) for size in ((5, 3), (1, 3), (1, 3)))
    moved = moved_rigidly(Net({}, Numpy()), x, shift, vector)
    np.testing.assert_allclose(moved, x @ rotation_from_vector(vector[0]).T + shift, atol=1e-10)
    again = moved_rigidly(Net({}, Torch()), *(torch.from_numpy(value) for value in (x, shift, vector)))
    np.testing.assert_allclose(again.numpy(), moved, atol=1e-12)


def test_validation_is_the_error_of_predictions(model: ShapeModel, pushes: Dataset) -> None:
    """What training calls the error is that of the checkpoint's motions, up to the points that it looks at."""
    errors = evaluate(model, pushes, "val")["mean_of_objects"]["rmse_pooled_mm"]
    assert model.checkpoint.config["val"]["val_rmse_mm"] == pytest.approx(errors, rel=0.1)


def test_refuses_what_it_cannot_move(model: ShapeModel) -> None:
    points = model.rest.points[:5]
    grey, solid = np.zeros((5, 1, 3), dtype=np.float32), np.ones(5, dtype=np.float32)
    splats = GaussianSplats(points, np.tile(1e-6 * np.eye(3, dtype=np.float32), (5, 1, 1)), grey, solid)
    with pytest.raises(InputError, match="cannot deform splats"):
        model.solve(splats)
    with pytest.raises(InputError, match="points at several places"):
        model.solve(PointCloud(np.zeros((3, 3), dtype=np.float32)))


def test_needs_bodies_whose_mass_is_known(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="odeform-shapes: expected pushes of bottle"):
        train(open_dataset("kick"), tmp_path / "kick.safetensors", "odeform-shapes", steps=1, report=lambda _: None)
