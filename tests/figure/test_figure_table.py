"""Interpolation between motions on a grid, and their compression."""

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from odeform.figure.table import compressed, cubic_weights, product_weights, quantised


@pytest.mark.parametrize("count", [2, 3, 8])
def test_cubic_weights_are_those_of_catmull_rom(count: int) -> None:
    values = np.random.default_rng(1).standard_normal(count)
    padded = np.concatenate([[2 * values[0] - values[1]], values, [2 * values[-1] - values[-2]]])
    spline = CubicHermiteSpline(np.arange(count), values, 0.5 * (padded[2:] - padded[:-2]))
    for place in np.linspace(0.0, count - 1.0, 23):
        assert cubic_weights(place, count) @ values == pytest.approx(spline(place), abs=1e-12)


def test_a_single_value_is_constant() -> None:
    assert cubic_weights(0.0, 1) == [1.0]
    assert product_weights(np.zeros(0), ()) == [1.0]


def test_the_last_parameter_changes_fastest() -> None:
    first, second = np.meshgrid(np.linspace(0.0, 1.0, 4), np.linspace(0.0, 1.0, 3), indexing="ij")
    weights = product_weights(np.array([0.3, 0.8]), (4, 3))
    assert weights @ (2.0 * first - 5.0 * second).ravel() == pytest.approx(0.6 - 4.0)


def test_rounding_is_within_half_a_step() -> None:
    values = np.random.default_rng(2).standard_normal((3, 50)) * [[1.0], [1e-3], [0.0]]
    whole, steps = quantised(values)
    assert whole.dtype == np.int16
    assert (np.abs(whole * steps[:, None] - values) <= 0.5001 * steps[:, None]).all()


@pytest.mark.parametrize("tolerance", [3e-2, 3e-3])
def test_compression_leaves_out_what_it_may(tolerance: float) -> None:
    rng, counts, scale = np.random.default_rng(3), (5, 4), np.array([1.0, 0.1, 1.0, 2.0])
    decay = 0.5 ** np.arange(16)
    motions = np.tensordot(rng.standard_normal((20, 16)) * decay, rng.standard_normal((16, 30, 4)), axes=1)
    table = compressed(motions.astype(np.float32), counts, scale, tolerance, 64)
    nodes = [np.array([i / 4, j / 3]) for i in range(5) for j in range(4)]
    missed = (np.stack([table.at(node) for node in nodes]) - motions) * scale
    left_out = np.sqrt(np.square(missed).sum(axis=2).mean() / 3.0)
    assert left_out < tolerance + 3e-4  # and that of 16 bits
    finer = compressed(motions.astype(np.float32), counts, scale, 0.1 * tolerance, 64)
    assert len(finer.sizes) > len(table.sizes)
    assert len(compressed(motions.astype(np.float32), counts, scale, 0.0, 3).sizes) == 3
