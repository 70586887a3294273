import numpy as np

from odeform.benchmark.probes import nearest_sequences, random_parameters, round_mesh, round_splats
from odeform.dataset.index import Dataset
from odeform.models.base import Predictor


def test_round_shapes_rest_where_the_body_does(predictors: dict[str, Predictor]) -> None:
    predictor = predictors["odeform"]
    low, high = predictor.rest.points.min(axis=0), predictor.rest.points.max(axis=0)
    mesh, splats = round_mesh(700, predictor), round_splats(700, predictor)
    assert mesh.points.shape == splats.points.shape == (700, 3)
    assert len(mesh.faces) == 2 * 700 - 4, "closed"
    assert np.allclose(mesh.points.min(axis=0), low, atol=2e-3)
    assert np.allclose(mesh.points.max(axis=0), high, atol=2e-3)


def test_random_parameters_fill_the_box_under_one_azimuth(predictors: dict[str, Predictor]) -> None:
    predictor = predictors["odeform"]
    drawn = random_parameters(predictor, 50)
    assert not any(predictor.schema.outside(predictor.schema.complete(parameters)) for parameters in drawn)
    assert len({parameters["azimuth"] for parameters in drawn}) == 1
    assert len({parameters["mass"] for parameters in drawn}) == 50


def test_nearest_sequences_are_of_the_test_split(dataset: Dataset) -> None:
    test = dataset.select("test")
    target = test[-1].parameters
    near = nearest_sequences(dataset, target, 2)
    assert near.entries[0] == test[-1]
    assert len(near.entries) == 2
    assert {entry.split for entry in near.entries} == {"test"}
