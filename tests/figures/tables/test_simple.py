"""What simple methods reach that see the truth."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from odeform.dataset.index import Dataset
from odeform.dataset.subsampling import FrameSubsampling
from odeform.dataset.training_data import prepare
from odeform.models.training.continuation import fit_dynamics
from odeform.schema import Schema, Window
from odeform.types import MotionSequence
from odeform_figures.tables.simple import ballistic, continued, evaluate_simple, hold_last, spline_through


class Falling(Dataset):
    """Three points that fall freely from different speeds, at 480 Hz; the scene has 120 Hz."""

    def sequences(self, split: str) -> Iterator[MotionSequence]:
        times = np.arange(241)[:, None, None] / 480.0
        points = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]])
        for speed in (0.0, 2.0):
            fall = speed * times * [1.0, 0.0, 0.0] + 0.5 * times**2 * [0.0, 0.0, -9.81]
            yield MotionSequence(times.ravel(), points + fall, np.zeros((0, 3), dtype=int), np.full(3, 1.0 / 3.0))


@pytest.fixture
def falling() -> Dataset:
    return Falling(Path(), Schema("fall", (), Window(0.0, 0.5, 120.0)), (), lambda entry: pytest.fail(entry.name))


def test_free_flight_is_ballistic(falling: Dataset) -> None:
    scores = evaluate_simple(ballistic(20), falling, "test", (20, 30))
    assert scores["rmse_pooled_mm"] == pytest.approx(0.0, abs=1e-9)


def test_hold_last_misses_by_the_way_fallen(falling: Dataset) -> None:
    scores = evaluate_simple(hold_last(20), falling, "test", (20, 21))
    moved = [np.array([speed / 120.0, 0.0, -0.5 * 9.81 * (20**2 - 19**2) / 120.0**2]) for speed in (0.0, 2.0)]
    assert scores["rmse_pooled_mm"] == pytest.approx(1e3 * np.sqrt(np.mean(np.square(moved))))


@pytest.mark.parametrize("stagger", [False, True])
def test_a_spline_is_right_where_it_sees(dataset: Dataset, stagger: bool) -> None:
    every = evaluate_simple(spline_through(FrameSubsampling()), dataset, "test", (0, 97))
    some = evaluate_simple(spline_through(FrameSubsampling(every=8, stagger=stagger)), dataset, "test", (0, 97))
    assert every["rmse_pooled_mm"] == 0.0
    assert some["rmse_pooled_mm"] > 0.1
    assert some["per_frame_rmse_mm"][95] < 1e-9 or stagger


def test_a_continuation_needs_little_of_the_truth(dataset: Dataset) -> None:
    data = prepare(dataset, None, FrameSubsampling((0, 60)))
    dynamics = fit_dynamics(data.theta["train"], data.reduced["train"], data.space.gyration_radius)
    predictors = continued(60, dynamics, data.space, data.schema), ballistic(60), hold_last(60)
    ahead, flown, held = (evaluate_simple(p, dataset, "test", (60, 70))["rmse_pooled_mm"] for p in predictors)
    assert ahead < min(flown, held)
    known = evaluate_simple(predictors[0], dataset, "test", (0, 60))
    assert known["rmse_pooled_mm"] == 0.0
