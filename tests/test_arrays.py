"""Arrays in steps: how precise they are, how small, and what is refused."""

import zlib

import numpy as np
import pytest

from odeform.arrays import STEP, in_steps, packed, row_steps, unpacked


def test_rows_that_are_summed_up_are_rounded_by_as_much_as_is_asked_for() -> None:
    """However different their coefficients are; each row adds the same."""
    rng = np.random.default_rng(0)
    sizes = np.geomspace(1e-2, 1e-4, 40)
    rows, coefficients = rng.normal(size=(40, 500)), sizes * rng.normal(size=(300, 40))
    kept = in_steps("rows", rows, row_steps(sizes, 1e-6))["rows"]
    error = coefficients @ (kept - rows)
    assert np.sqrt((error**2).mean()) == pytest.approx(1e-6, rel=0.1)


@pytest.mark.parametrize("shape", [(3, 7), (3, 4, 3), (3, 0), (1, 100)])
def test_they_come_back_to_the_last_bit(shape: tuple[int, ...]) -> None:
    values = np.random.default_rng(1).normal(size=shape)
    kept = in_steps("a", values, np.geomspace(1e-3, 1e-1, shape[0]))
    again = unpacked(packed(kept["a"], kept[f"a{STEP}"]), shape, kept[f"a{STEP}"])
    assert again.dtype == kept["a"].dtype == np.float32
    assert np.array_equal(again, kept["a"])


def test_small_integers_of_both_signs_take_few_bytes() -> None:
    values = np.rint(3.0 * np.random.default_rng(2).normal(size=(10, 5000)))
    bits = 8.0 * len(packed(values, np.ones(10))) / values.size
    assert bits < 1.1 * (np.log2(3.0) + 0.5 * np.log2(2.0 * np.pi * np.e)) + 0.1


def test_every_row_keeps_some_precision_and_no_more_than_a_float_has() -> None:
    values = np.array([[1.0, 0.4], [1e-3, -2e-4], [0.0, 0.0]])
    coarse, fine = (in_steps("a", values, np.full(3, step)) for step in (1e3, 1e-30))
    assert (np.abs(coarse["a"] - values) <= np.abs(values).max(axis=1, keepdims=True) / 64 + 1e-9).all()
    assert np.allclose(fine["a"], values, rtol=1e-6, atol=0.0)
    assert np.array_equal(unpacked(packed(fine["a"], fine["a.step"]), (3, 2), fine["a.step"]), fine["a"])


@pytest.mark.parametrize("damage", [lambda data: data[:-3], lambda data: data[::-1].copy(), lambda data: data[:0]])
def test_damaged_bytes_are_refused(damage) -> None:
    data = packed(np.random.default_rng(3).normal(size=(4, 50)), np.full(4, 1e-3))
    with pytest.raises((zlib.error, ValueError)):
        unpacked(damage(data), (4, 50), np.full(4, 1e-3))


@pytest.mark.parametrize("shape", [(4, 49), (4, 51), (2, 100), (-4, -50)])
def test_another_shape_is_refused(shape: tuple[int, int]) -> None:
    with pytest.raises((zlib.error, ValueError)):
        unpacked(packed(np.ones((4, 50)), np.ones(4)), shape, np.ones(4))
