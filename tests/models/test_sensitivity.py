import numpy as np
import pytest

from odeform.models.frontier import EXACT
from odeform.models.latent.model import LatentModel
from odeform.models.registry import load
from odeform.solver.integrate import SolverSettings

TIMES = np.array([0.004, 0.02, 0.11, 0.4, 0.93])
APART = 1e-4


@pytest.fixture
def model() -> LatentModel:
    loaded = load("mass-elastic")
    assert isinstance(loaded, LatentModel)
    return loaded


def theta_of(model: LatentModel) -> np.ndarray:
    return np.linspace(-0.6, 0.7, len(model.schema.learned))


def motion(model: LatentModel, theta: np.ndarray, quality: SolverSettings = EXACT) -> np.ndarray:
    return model.integrate(theta, model.evaluate_basis(model.rest, 0.0), quality, float(TIMES[-1])).reduced(TIMES)


def test_the_values_are_those_of_the_motion(model: LatentModel) -> None:
    jet = model.sensitivities(theta_of(model), TIMES, EXACT)
    assert jet.shape == (1 + len(theta_of(model)), len(TIMES), 6 + model.space.basis.modes)
    assert np.abs(jet[0] - motion(model, theta_of(model))).max() < 1e-7


def test_derivatives_are_those_of_differences(model: LatentModel) -> None:
    """Against central differences of a converged solution; both are off by about a part in a million."""
    theta = theta_of(model)
    jet = model.sensitivities(theta, TIMES, EXACT)
    for index, ahead in enumerate(APART * np.eye(len(theta))):
        slope = (motion(model, theta + ahead) - motion(model, theta - ahead)) / (2.0 * APART)
        assert np.abs(jet[1 + index] - slope).max() < 1e-5 * np.abs(slope).max()


def test_single_precision_keeps_them(model: LatentModel) -> None:
    exact = model.sensitivities(theta_of(model), TIMES, EXACT)
    single = model.sensitivities(theta_of(model), TIMES, SolverSettings("dopri5", tolerance=1e-6))
    assert np.abs(single - exact).max() < 2e-5 * np.abs(exact).max()


def test_fixed_steps_converge_to_them(model: LatentModel) -> None:
    exact = model.sensitivities(theta_of(model), TIMES, EXACT)
    steps = (4e-3, 2e-3)
    errors = [
        np.abs(
            model.sensitivities(theta_of(model), TIMES, SolverSettings("rk4", step=step, dtype="float64")) - exact
        ).max()
        for step in steps
    ]
    assert errors[1] < errors[0] / 8.0
