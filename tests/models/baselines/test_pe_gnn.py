"""The graph network of the final state: trained for a few steps, with and without a contact."""

from pathlib import Path

import numpy as np
import pytest
from pushes import pushes
from scipy.spatial.distance import cdist

from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.evaluation.metrics import evaluate
from odeform.models.base import Predictor
from odeform.models.points.node_graph import NodeGraph
from odeform.models.registry import load
from odeform.motion.base import Motion
from odeform.motion.caveats import caveats
from odeform.motion.point_motion import PointFrame
from odeform.training.train import train

pytest.importorskip("torch_geometric")


def silent(_: str) -> None:
    pass


@pytest.fixture(scope="module")
def data() -> Dataset:
    return pushes(40)


@pytest.fixture(scope="module")
def file(data: Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("pe-gnn") / "pushes.safetensors"
    train(data, out, "pe-gnn", steps=20, report=silent)
    return out


@pytest.fixture(scope="module")
def predictor(file: Path) -> Predictor:
    return load(file)


@pytest.fixture
def motion(predictor: Predictor) -> Motion:
    return predictor.solve(parameters={"object": "plate"})


def graph() -> NodeGraph:
    nodes = np.random.default_rng(0).normal(size=(30, 3))
    return NodeGraph(nodes, PointFrame((0.0, 0.0, 0.0), 1.0, 4.0, 1.0, 1.0, 1.0))


def test_edges_come_from_the_nearest_neighbours() -> None:
    body = graph()
    sources, targets = body.edges
    distance = cdist(body.nodes, body.nodes)
    for node in range(30):
        assert set(sources[targets == node]) == set(np.argsort(distance[node])[1:9])
    assert np.allclose(body.along[:, 3], distance[sources, targets])


def test_interpolation_is_exact_at_nodes_and_of_constants() -> None:
    body = graph()
    moved = np.random.default_rng(1).normal(size=(30, 3))
    assert np.allclose(body.interpolated(moved, body.nodes), moved, atol=1e-9)
    elsewhere = np.random.default_rng(2).normal(size=(50, 3))
    assert np.allclose(body.interpolated(np.ones((30, 3)), elsewhere), 1.0)


@pytest.mark.slow
def test_rest_and_final_state_are_all_there_is(motion: Motion) -> None:
    rest, middle, end = motion.vertices(np.array([0.0, 0.05, 0.1]))
    assert np.array_equal(rest, motion.geometry.points)
    assert np.array_equal(middle, end)
    assert not np.array_equal(rest, end)


@pytest.mark.slow
def test_says_that_other_moments_are_not_predicted(motion: Motion) -> None:
    assert "only the state at 0.1 s is predicted: 2 of 3 frames" in caveats(motion, np.array([0.0, 0.05, 0.1]))[-1]
    assert "final state only" in motion.stats.solver
    assert not any("only the state" in line for line in caveats(motion, np.array([0.1])))


@pytest.mark.slow
def test_is_scored_on_the_last_frame_only(predictor: Predictor, data: Dataset) -> None:
    scores = evaluate(predictor, data)
    assert len(scores["per_frame_rmse_mm"]) == 1
    errors = []
    for truth in data.sequences("test"):
        last = predictor.solve(truth.rest, truth.parameters).vertices(0.1)
        errors.append(((last.astype(float) - truth.until(0.1).vertices[-1]) ** 2).mean())
    assert scores["rmse_pooled_mm"] == pytest.approx(1e3 * np.sqrt(np.mean(errors)), rel=1e-6)
    with pytest.raises(InputError, match="covers only"):
        evaluate(predictor, data, window=(0, 5))


@pytest.mark.slow
def test_more_training_is_better(data: Dataset, predictor: Predictor, tmp_path: Path) -> None:
    longer = train(data.of("plate"), tmp_path / "longer.safetensors", "pe-gnn", steps=300, report=silent)
    short = predictor.checkpoint.scores["per_object"]["plate"]["rmse_pooled_mm"]
    assert longer.checkpoint.scores["rmse_pooled_mm"] < 0.9 * short


@pytest.mark.slow
def test_moves_balls_without_a_contact(dataset: Dataset, tmp_path: Path) -> None:
    predictor = train(dataset, tmp_path / "kick.safetensors", "pe-gnn", steps=20, report=silent)
    assert np.isfinite(predictor.solve(parameters={"force": 120.0}).vertices(predictor.schema.window.stop)).all()
