from typing import cast

import pytest

from odeform.dataset.index import Dataset
from odeform.model.data import prepare
from odeform.model.odeform import ODeform
from odeform.predictor import Predictor
from odeform.solver.integrate import Quality
from odeform.training.qualities import REFERENCE, choose_qualities


@pytest.mark.parametrize("share", [1.0, 0.1])
def test_a_smaller_error_asks_for_more_evaluations(
    dataset: Dataset, predictors: dict[str, Predictor], share: float
) -> None:
    model = cast(ODeform, predictors["odeform"])
    data = prepare(dataset, modes=model.space.basis.modes)
    evaluations = []
    for factor in (1.0, 0.01):
        chosen = choose_qualities(model, data, {"draft": factor * share, "balanced": 0.1 * factor * share})
        assert chosen["reference"] == REFERENCE
        motions = [model.solve(quality=Quality(**chosen[name])) for name in ("draft", "balanced")]  # pyright: ignore
        evaluations += [motion.stats.evaluations for motion in motions]
    assert evaluations[0] <= evaluations[1]
    assert evaluations[0] < evaluations[2]
    assert evaluations[1] < evaluations[3]


def test_nothing_is_exact_enough(dataset: Dataset, predictors: dict[str, Predictor]) -> None:
    model = cast(ODeform, predictors["odeform"])
    data = prepare(dataset, modes=model.space.basis.modes)
    assert choose_qualities(model, data, {"balanced": 1e-12})["balanced"] == REFERENCE


def test_a_checkpoint_brings_its_qualities(predictors: dict[str, Predictor]) -> None:
    assert list(predictors["odeform"].qualities) == ["draft", "balanced", "reference"]
