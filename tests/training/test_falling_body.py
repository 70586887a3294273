"""Training on a ball that falls straight, whose contact of contact is known."""

from dataclasses import replace

import numpy as np
import pytest
from rolls import HEIGHT, RATE, falls

from odeform.dataset.index import Dataset
from odeform.dataset.training_data import prepare
from odeform.errors import InputError
from odeform.evaluation.metrics import evaluate
from odeform.models.base import Predictor
from odeform.models.rolling.model import RollingModel
from odeform.models.rolling.training.fit import fit_rolling_body
from odeform.models.training.request import TrainRequest
from odeform.training.train import train

SEEN = 36  # frames, to the second flight; the whole window has 61
EVERY = 5


def silent(_: str) -> None: ...


@pytest.fixture(scope="module")
def dataset() -> Dataset:
    return falls()


@pytest.fixture(scope="module")
def sparse(dataset: Dataset, tmp_path_factory: pytest.TempPathFactory) -> Predictor:
    """Trained on every fifth frame."""
    file = tmp_path_factory.mktemp("falls") / "falls.safetensors"
    return train(dataset, file, "odeform-rolling", steps=20, every=EVERY, report=silent)


@pytest.fixture(scope="module")
def seen(dataset: Dataset, tmp_path_factory: pytest.TempPathFactory) -> Predictor:
    """Trained on the first `SEEN` frames."""
    file = tmp_path_factory.mktemp("falls") / "falls.safetensors"
    return train(dataset, file, "odeform-rolling", steps=20, window=(0, SEEN), report=silent)


@pytest.mark.slow
def test_a_motion_begins_at_rest_and_falls_freely(sparse: Predictor) -> None:
    assert isinstance(sparse, RollingModel)
    assert sparse.space.rolling is None
    motion, times = sparse.solve(quality="reference"), np.linspace(0.0, 0.1, 21)
    assert np.array_equal(motion.vertices(0.0), sparse.rest.points)
    fallen = sparse.rest.points[:, 2].mean() - motion.vertices(times)[..., 2].mean(axis=1)
    assert np.allclose(fallen, 0.5 * 9.81 * times**2, atol=1e-5)


@pytest.mark.slow
def test_what_happens_between_the_frames_follows_from_the_ode(
    sparse: Predictor, dataset: Dataset, tmp_path_factory: pytest.TempPathFactory
) -> None:
    file = tmp_path_factory.mktemp("falls") / "gp.safetensors"
    rival = train(dataset, file, "gp", every=EVERY, report=silent)
    ours, other = (evaluate(of, dataset, "test", (12, 60))["rmse_pooled_mm"] for of in (sparse, rival))
    assert ours < 0.3 * other


@pytest.mark.slow
def test_landings_beyond_the_window_follow_from_the_ode(seen: Predictor, dataset: Dataset) -> None:
    assert seen.schema.window.stop == pytest.approx((SEEN - 1) / RATE)
    errors = evaluate(seen, dataset, "test", (SEEN, 61))["rmse_pooled_mm"]
    held = [s.vertices[SEEN:] - s.vertices[SEEN - 1] for s in dataset.sequences("test")]
    assert errors < 0.1 * 1e3 * np.sqrt(np.mean([np.square(moved).mean() for moved in held]))


@pytest.mark.slow
def test_a_corrected_motion_goes_on_without_a_jump(seen: Predictor) -> None:
    assert isinstance(seen, RollingModel)
    evaluated, settings, stop = (
        seen.evaluate_basis(seen.rest, 0.0),
        seen.qualities["reference"],
        seen.schema.window.stop,
    )
    assert seen.residual is None or seen.residual.stop == stop
    for mass in (-0.9, 0.0, 0.9):
        motion = seen.trajectory(np.array([mass]), evaluated, settings, stop + 0.2)
        times = stop + np.linspace(-0.02, 0.02, 81)
        y = motion.reduced(times)
        assert np.abs(np.diff(y, axis=0)).max() < 2.0 * np.sqrt(2.0 * 9.81 * HEIGHT) * 0.0005
        assert all(np.allclose(motion.reduced(times[k : k + 1])[0], y[k], atol=1e-12) for k in (70, 20, 45))


def test_what_does_not_fall_from_rest_is_refused(dataset: Dataset) -> None:
    data, request = prepare(dataset, patterns=True), TrainRequest("odeform-rolling", steps=1)
    thrown = data.reduced["train"].copy()
    thrown[..., 2] += data.times
    lying = replace(data.space, anchor=data.space.anchor - [0.0, 0.0, HEIGHT])
    for other in (replace(data, reduced={**data.reduced, "train": thrown}), replace(data, space=lying)):
        with pytest.raises(InputError, match="falls straight from rest"):
            fit_rolling_body(other, request, silent)
