import numpy as np
import pytest

from odeform.evaluation.bootstrap import mean_interval, pooled_draws, pooled_interval


def test_the_interval_holds_as_often_as_it_says() -> None:
    rng = np.random.default_rng(1)
    inside = []
    for _ in range(300):
        squares = rng.chisquare(8, size=60)  # of mean 8
        found = pooled_interval((10.0 * squares, np.full(60, 10.0)))
        assert found is not None
        inside.append(found[0] <= np.sqrt(8.0) <= found[1])
    assert 0.90 <= np.mean(inside) <= 0.98


def test_one_motion_that_makes_most_of_the_error_widens_it() -> None:
    even, counts = np.full(50, 4.0), np.ones(50)
    assert pooled_interval((even, counts)) == pytest.approx((2.0, 2.0))
    odd = even.copy()
    odd[7] = 400.0
    low, high = pooled_interval((odd, counts)) or (0.0, 0.0)
    assert low == pytest.approx(2.0)
    assert high > 4.0


def test_longer_motions_count_for_more() -> None:
    sums, counts = np.array([100.0, 4.0]), np.array([100.0, 1.0])
    draws = pooled_draws((sums, counts))
    assert set(np.round(draws, 6)) == {1.0, 2.0, round(float(np.sqrt(104.0 / 101.0)), 6)}


def test_a_single_motion_has_none_and_groups_are_drawn_by_themselves() -> None:
    one = (np.array([4.0]), np.array([1.0]))
    many = (np.full(9, 9.0), np.ones(9))
    assert pooled_interval(one) is None
    assert mean_interval([one, many]) is None
    assert mean_interval([many, (np.full(9, 1.0), np.ones(9))]) == pytest.approx((2.0, 2.0))
