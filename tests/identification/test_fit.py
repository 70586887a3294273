import numpy as np
import pytest

from odeform.identification.fit import normal_equations
from odeform.identification.linear import Linear

TIMES, COORDINATES, CAUSES, PARAMETERS = 5, 12, 8, 2
NOISE = 0.7


def problem(seed: int = 0) -> tuple[Linear, np.ndarray]:
    """A random linear problem without residuals, and variances of its causes."""
    rng = np.random.default_rng(seed)
    spread = rng.normal(size=(TIMES, COORDINATES, CAUSES))
    jacobian = rng.normal(size=(TIMES, CAUSES, PARAMETERS))
    return Linear(np.zeros((TIMES, COORDINATES)), spread, jacobian), rng.uniform(0.01, 2.0, size=(TIMES, CAUSES)) ** 2


def observed(linear: Linear, variances: np.ndarray, theta: np.ndarray, rng: np.random.Generator) -> Linear:
    causes = linear.jacobian @ theta + np.sqrt(variances) * rng.normal(size=variances.shape)
    residual = np.einsum("tnk,tk->tn", linear.spread, causes) + NOISE * rng.normal(size=linear.residual.shape)
    return Linear(residual, linear.spread, linear.jacobian)


@pytest.mark.parametrize("coordinates", [COORDINATES, 3])
def test_normal_equations_agree_with_the_full_covariance(coordinates: int) -> None:
    """Also with fewer coordinates than causes, which alone could not be determined."""
    linear, variances = problem()
    linear = observed(linear, variances, np.array([0.3, -0.5]), np.random.default_rng(1))
    linear = Linear(linear.residual[:, :coordinates], linear.spread[:, :coordinates], linear.jacobian)
    information, score, cost = np.zeros((PARAMETERS, PARAMETERS)), np.zeros(PARAMETERS), 0.0
    rows = zip(linear.residual, linear.spread, linear.jacobian, variances, strict=True)
    for residual, spread, jacobian, squares in rows:
        inverse = np.linalg.inv(NOISE**2 * np.eye(coordinates) + spread * squares @ spread.T)
        slopes = spread @ jacobian
        information += slopes.T @ inverse @ slopes
        score += slopes.T @ inverse @ residual
        cost += residual @ inverse @ residual
    ours = normal_equations(linear, variances, NOISE)
    assert np.allclose(ours[0], information)
    assert np.allclose(ours[1], score)
    assert ours[2] == pytest.approx(cost)


def test_intervals_have_their_nominal_coverage() -> None:
    linear, variances = problem()
    rng, theta, inside = np.random.default_rng(2), np.array([0.3, -0.5]), []
    for _ in range(500):
        information, score, _ = normal_equations(observed(linear, variances, theta, rng), variances, NOISE)
        covariance = np.linalg.inv(information)
        inside.append(np.abs(covariance @ score - theta) < 1.6449 * np.sqrt(np.diag(covariance)))
    assert np.mean(inside, axis=0) == pytest.approx(0.9, abs=0.03)
