import pytest

from odeform.benchmark.roofline import least_ms, scaling
from odeform.models.base import Predictor


def test_the_slower_of_arithmetic_and_memory_binds() -> None:
    # a thousand points, ten modes, one frame: 30 + 7 + 3 numbers a point through memory, 2 * 51 operations
    assert least_ms(1000, 10, 1, gflops=1e9, gb_s=10.0) == pytest.approx(4e3 * (30 + 7 + 3) / 10.0 / 1e6)
    assert least_ms(1000, 10, 1, gflops=2.0, gb_s=1e9) == pytest.approx(2e3 * (30 + 21) / 2.0 / 1e6)
    # frames of one motion share what they read
    both = least_ms(1000, 10, 2, gflops=1e9, gb_s=10.0)
    assert both < 2.0 * least_ms(1000, 10, 1, gflops=1e9, gb_s=10.0)


def test_scaling_measures_each_size(predictors: dict[str, Predictor]) -> None:
    rows = scaling(predictors["odeform"], (300, 3000))
    assert [row["points"] for row in rows] == [300, 3000]
    assert all(row[key] > 0.0 for row in rows for key in ("solve_ms", "basis_ms", "decode_ms"))
