import numpy as np
import pytest

from odeform.models.conformal import SCORES, conformal_factor, motion_score
from odeform.models.error_band import ErrorBand


def test_further_motions_stay_within_as_often_as_it_says() -> None:
    rng = np.random.default_rng(0)
    inside = []
    for _ in range(2000):
        scores = rng.normal(size=40)
        inside.append(np.exp(rng.normal()) <= (conformal_factor(scores, 0.9) or 0.0))
    assert 0.88 <= np.mean(inside) <= 0.93


def test_of_too_few_motions_there_is_none() -> None:
    assert conformal_factor(np.zeros(8), 0.9) is None
    assert conformal_factor(np.arange(9.0), 0.9) == pytest.approx(np.exp(8.0))


def test_the_score_is_of_the_worst_frame() -> None:
    assert motion_score(np.array([5.0, 1.0, 4.0]), np.array([0.0, 1.0, 2.0])) == pytest.approx(np.log(2.0))


def test_scores_in_a_checkpoint_widen_the_upper_band_alone() -> None:
    rng = np.random.default_rng(1)
    arrays = {
        "val.theta": rng.uniform(-1.0, 1.0, (30, 2)),
        "val.times": np.linspace(0.0, 1.0, 21),
        "val.rmse_mm": np.exp(rng.normal(size=(30, 21))),
    }
    times = np.array([0.2, 0.9])
    plain = ErrorBand(arrays).at(np.zeros(2), times)
    wide = ErrorBand({**arrays, SCORES: np.full(20, np.log(3.0))}).at(np.zeros(2), times)
    np.testing.assert_allclose(wide[:, 1], 3.0 * plain[:, 1])
    np.testing.assert_array_equal(wide[:, 0], plain[:, 0])
