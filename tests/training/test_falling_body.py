"""Training on a ball that falls straight, whose law of contact is known."""

from pathlib import Path

import numpy as np
import pytest
from rolls import HEIGHT, RATE, falls

from odeform.dataset.index import Dataset
from odeform.evaluation.metrics import evaluate
from odeform.models.base import Predictor
from odeform.models.rolling.model import RollingODeform
from odeform.training.train import train

pytestmark = pytest.mark.slow

SEEN = 48  # frames, to the middle of the second flight; the whole window has 97


def silent(_: str) -> None: ...


@pytest.fixture(scope="module")
def dataset() -> Dataset:
    return falls()


@pytest.fixture(scope="module")
def whole(dataset: Dataset, tmp_path_factory: pytest.TempPathFactory) -> Predictor:
    return train(
        dataset, tmp_path_factory.mktemp("falls") / "falls.safetensors", "odeform-rolling", steps=40, report=silent
    )


@pytest.fixture(scope="module")
def seen(dataset: Dataset, tmp_path_factory: pytest.TempPathFactory) -> Predictor:
    """Trained on the first `SEEN` frames."""
    file = tmp_path_factory.mktemp("falls") / "falls.safetensors"
    return train(dataset, file, "odeform-rolling", steps=40, window=(0, SEEN), report=silent)


def test_motions_that_it_has_not_seen(whole: Predictor) -> None:
    assert isinstance(whole, RollingODeform)
    assert whole.space.rolling is None
    assert whole.checkpoint.scores["rmse_pooled_mm"] < 0.5
    assert whole.checkpoint.scores["deformation_relative"] < 0.15


def test_a_motion_begins_at_rest_and_falls_freely(whole: Predictor) -> None:
    motion, times = whole.solve(quality="reference"), np.linspace(0.0, 0.15, 31)
    assert np.array_equal(motion.vertices(0.0), whole.rest.points)
    fallen = whole.rest.points[:, 2].mean() - motion.vertices(times)[..., 2].mean(axis=1)
    assert np.allclose(fallen, 0.5 * 9.81 * times**2, atol=1e-5)


def test_landings_beyond_the_window_follow_from_the_ode(seen: Predictor, dataset: Dataset) -> None:
    assert seen.schema.window.stop == pytest.approx((SEEN - 1) / RATE)
    later = (SEEN, SEEN + 30)
    errors = evaluate(seen, dataset, "test", later)["rmse_pooled_mm"]
    still = [s.vertices[SEEN:] - s.vertices[SEEN - 1] for s in dataset.sequences("test")]
    assert errors < 0.05 * 1e3 * np.sqrt(np.mean([np.square(moved[:30]).mean() for moved in still]))


def test_a_corrected_motion_goes_on_without_a_jump(seen: Predictor) -> None:
    assert isinstance(seen, RollingODeform)
    assert seen.correction is not None
    stop = seen.correction.stop
    assert stop == seen.schema.window.stop
    evaluated, settings = seen.evaluate_basis(seen.rest, 0.0), seen.qualities["reference"]
    for mass in (-0.9, 0.0, 0.9):
        motion = seen.trajectory(np.array([mass]), evaluated, settings, stop + 0.2)
        times = stop + np.linspace(-0.02, 0.02, 81)
        y = motion.reduced(times)
        assert np.abs(np.diff(y, axis=0)).max() < 2.0 * np.sqrt(2.0 * 9.81 * HEIGHT) * 0.0005
        together, alone = motion.reduced(times), [motion.reduced(times[k : k + 1])[0] for k in (70, 20, 45)]
        assert all(np.array_equal(one, together[k]) for one, k in zip(alone, (70, 20, 45), strict=True))


def test_frames_may_be_left_out(dataset: Dataset, tmp_path: Path) -> None:
    errors = {}
    for model in ("odeform-rolling", "gp"):
        steps = 40 if model == "odeform-rolling" else None
        few = train(dataset, tmp_path / model, model, steps=steps, every=5, report=silent)
        errors[model] = evaluate(few, dataset, "test", (10, 80))["rmse_pooled_mm"]
    assert errors["odeform-rolling"] < 0.3 * errors["gp"]
