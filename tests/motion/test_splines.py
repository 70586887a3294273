"""Between frames, motions are smooth."""

import numpy as np

from odeform.motion.splines import catmull_rom


def test_quadratics_are_exact_and_slopes_are_central() -> None:
    fractions = np.linspace(0.0, 1.0, 11)

    def between(values: np.ndarray, at: np.ndarray) -> np.ndarray:
        return catmull_rom(*(np.full(at.shape, value) for value in values), at)

    times = np.array([-1.0, 0.0, 1.0, 2.0])
    np.testing.assert_allclose(
        between(2.0 - 3.0 * times + 0.7 * times**2, fractions), 2.0 - 3.0 * fractions + 0.7 * fractions**2, atol=1e-12
    )
    values, step = np.array([0.3, -1.0, 2.0, 0.5]), 1e-6
    ends = between(values, np.array([0.0, step, 1.0 - step, 1.0]))
    np.testing.assert_array_equal(ends[[0, 3]], values[1:3])
    slopes = [(ends[1] - ends[0]) / step, (ends[3] - ends[2]) / step]
    np.testing.assert_allclose(slopes, 0.5 * (values[2:] - values[:2]), atol=1e-4)
