"""Kernel ridge regression and the search for its settings."""

import numpy as np
import pytest

from odeform.models.kernels.regression import Kernel
from odeform.models.kernels.ridge import ORDERS, Ridge, search_ridge
from odeform.types import Floats


def _surface(theta: Floats) -> Floats:
    return np.stack([np.sin(2.0 * theta[:, 0]), np.cos(1.5 * theta[:, 0]) * theta[:, 1]], axis=1)


@pytest.fixture(scope="module")
def theta() -> Floats:
    return np.random.default_rng(0).uniform(-1.0, 1.0, (30, 2))


def test_each_is_predicted_from_the_others(theta: Floats) -> None:
    ridge, known, asked = Ridge(Kernel(np.array([0.7, 1.5])), 1e-4), theta[:22], theta[22:]
    missed = [ridge.fit(known, _surface(known))(asked) - _surface(asked)]
    for index in range(len(known)):
        others = np.arange(len(known)) != index
        predicted = ridge.fit(known[others], _surface(known[others]))(known[index : index + 1])
        missed.append(predicted - _surface(known[index : index + 1]))
    rms = float(np.sqrt(np.square(np.concatenate(missed)).sum(axis=1).mean()))
    assert ridge.rms(known, _surface(known), asked, _surface(asked)) == pytest.approx(rms, rel=1e-9)


def test_the_found_settings_have_the_least_error_of_both_splits(theta: Floats) -> None:
    known, asked = theta[:22], theta[22:]
    found = search_ridge(known, _surface(known), (asked, _surface(asked)))
    assert [trial.error for trial in found] == sorted(trial.error for trial in found)

    def error(ridge: Ridge) -> float:
        return ridge.rms(known, _surface(known), asked, _surface(asked))

    assert found[0].error == error(found[0])
    for scales in ((0.3, 0.3), (1.0, 1.0), (3.0, 3.0)):
        assert found[0].error <= error(Ridge(Kernel(np.array(scales)), 1e-6))


def test_training_motions_count_where_validation_is_a_single_one(theta: Floats) -> None:
    """A validation motion that any length scale predicts, at a training motion: those left out decide."""
    known = theta[:25]
    found = search_ridge(known, _surface(known), (known[:1], _surface(known[:1])))[0]
    missed = found.fit(known, _surface(known))(theta[25:]) - _surface(theta[25:])
    assert np.abs(missed).max() < 0.1


def test_without_validation_motions_those_left_out_decide(theta: Floats) -> None:
    found = search_ridge(theta, _surface(theta))[0]
    assert found.error == found.rms(theta, _surface(theta), theta[:0], _surface(theta[:0]))


def test_settings_without_a_solution_are_passed_over() -> None:
    """Two equal inputs: without noise, the kernel matrix is singular."""
    known = np.zeros((2, 1))
    found = search_ridge(known, np.array([[1.0], [2.0]]), (np.array([[0.0]]), np.array([[1.5]])))[0]
    assert np.isfinite(found.error)
    assert 1.0 < found.fit(known, np.array([[1.0], [2.0]]))(np.zeros((1, 1)))[0, 0] < 2.0


def _kink(theta: Floats) -> Floats:
    return np.abs(theta[:, :1] - 0.1) + 0.3 * theta[:, 1:]


@pytest.mark.parametrize(("outputs", "order"), [(_surface, 6), (_kink, 2)])
def test_smooth_motions_have_a_smooth_kernel_and_kinks_a_rough_one(theta: Floats, outputs: object, order: int) -> None:
    assert callable(outputs)
    found = search_ridge(theta, outputs(theta), orders=ORDERS)
    assert found[0].kernel.order == order
    assert {trial.kernel.order for trial in found} == set(ORDERS)
    again = search_ridge(theta, outputs(theta), start=found[0])
    assert [trial.kernel.order for trial in again] == [order]
