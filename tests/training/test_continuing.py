"""The dynamics that continue motions, on a bouncing ball, and whether they are kept."""

from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from odeform.dataset.index import Dataset
from odeform.dataset.store import open_dataset
from odeform.dataset.training_data import TrainingData, prepare
from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.models.continuation import Dynamics, spread_regression, without_continuation
from odeform.models.latent.model import LatentModel
from odeform.models.reduced_model import ReducedModel
from odeform.models.registry import load, load_model
from odeform.models.training import continuation
from odeform.models.training.continuation import fit_dynamics, predicted_errors, with_continuation
from odeform.simulation.scenes.kick import PULSE
from odeform.types import Floats
from odeform_figures.continuation import refitted

RATE, GRAVITY, HEIGHT = 60.0, -10.0, 0.2


def bounce(theta: float, frames: int) -> Floats:
    """(T, 7): a ball falls from `HEIGHT` onto a damped spring, whose depth is its deformation."""
    stiffness = 3000.0 * np.exp(0.3 * theta)

    def field(_: float, state: Floats) -> list[float]:
        depth = max(-state[0] - HEIGHT, 0.0)
        return [state[1], GRAVITY + (stiffness * depth - 20.0 * state[1] if depth else 0.0)]

    times = np.arange(frames) / RATE
    height = solve_ivp(field, (0.0, times[-1]), [0.0, 0.0], t_eval=times, rtol=1e-8, atol=1e-10, max_step=2e-3).y[0]
    y = np.zeros((frames, 7))
    y[:, 2], y[:, 6] = height, np.maximum(-height - HEIGHT, 0.0)
    return y


def test_a_second_landing_follows_from_the_first() -> None:
    known, later = 22, 14
    theta, unseen = np.linspace(-1.0, 1.0, 40)[:, None], np.array([[-0.63], [0.02], [0.71]])
    truth = np.stack([bounce(t, known + later) for t in unseen[:, 0]])
    dynamics = fit_dynamics(theta, np.stack([bounce(t, known) for t in theta[:, 0]]), gyration_radius=0.1)
    assert dynamics.gravity[2] == pytest.approx(GRAVITY / RATE**2, rel=1e-6)
    before, now = truth[:, known - 2], truth[:, known - 1]
    flown, out, fall = [before, now], [], (before, now)
    for _ in range(later):
        before, now = now, dynamics.next(before, now, unseen)
        out.append(now)
        fall = fall[1], dynamics.flight(*fall)
        flown.append(fall[1])

    def rms(y: list[Floats] | Floats) -> float:
        return float(np.sqrt(((np.stack(y, axis=1) - truth[:, known:])[..., 2] ** 2).mean()))

    held = [truth[:, known - 1]] * later
    assert (truth[:, known + 2 :, 6] > 0.0).any()  # it lands within the held-out part
    assert rms(out) < 0.25 * min(rms(held), rms(flown[2:]))


@pytest.fixture(scope="module")
def data(dataset: Dataset, predictors: dict[str, Predictor]) -> TrainingData:
    return prepare(dataset, cast(LatentModel, predictors["odeform"]).space.basis.modes)


def test_what_does_not_foretell_is_not_kept(
    data: TrainingData, predictors: dict[str, Predictor], monkeypatch: pytest.MonkeyPatch
) -> None:
    model = cast(LatentModel, predictors["odeform"])
    counts = []

    def falling(theta: Floats, reduced: Floats, gyration_radius: float) -> Dynamics:
        counts.append(reduced.shape[1])
        width = 2 + 6 + theta.shape[1] + 3
        pose = spread_regression(np.zeros((0, width - 3)), np.zeros((0, 6)))
        deformation = spread_regression(np.zeros((0, width)), np.zeros((0, reduced.shape[2] - 6)))
        return Dynamics(np.array([0.0, 0.0, -1.0]), 0.0, 1.0, np.ones(width), pose, deformation)

    monkeypatch.setattr(continuation, "fit_dynamics", falling)
    assert predicted_errors(model, data) is None
    free = data.first_free
    assert data.times[free] >= PULSE > data.times[free - 1]  # nothing explains the push
    assert counts == [round(len(data.times) / 1.5) - free]  # fitted without the held-out part
    assert with_continuation(model, data) is model.checkpoint
    # a criterion that passes whatever is kept
    errors = np.full((len(data.theta["val"]), 40), 3.0)
    monkeypatch.setattr(continuation, "predicted_errors", lambda *_: errors)
    kept = with_continuation(model, data)
    assert kept.schema.window.reach > 0.0
    assert np.array_equal(kept.arrays["val.later_mm"], errors.astype(np.float32))
    assert counts[-1] == len(data.times) - free


def test_a_model_keeps_its_window_with_another_continuation() -> None:
    dataset, model = open_dataset("mass-elastic"), load("mass-elastic/nearest")
    few = replace(dataset, entries=dataset.entries[::10])
    again = load_model(refitted(without_continuation(model.checkpoint), few))
    assert isinstance(again, ReducedModel)
    assert again.dynamics is not None
    inside = again.schema.window.times
    motions = [one.solve(None, {"mass": 0.4}) for one in (model, again)]
    assert np.array_equal(*(motion.vertices(inside) for motion in motions))


def test_networks_are_not_continued() -> None:
    with pytest.raises(InputError, match="direct: expected a model of reduced coordinates"):
        refitted(load("mass-elastic/direct").checkpoint, open_dataset("mass-elastic"))
