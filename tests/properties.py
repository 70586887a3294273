"""Settings and strategies of property tests: the same few examples in every run, so that none depends on chance."""

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from odeform.geometry.rigid import rotation_from_vector
from odeform.geometry.similarity import Similarity

PROPERTY = settings(
    max_examples=50, deadline=None, derandomize=True, database=None, suppress_health_check=[HealthCheck.too_slow]
)


def vectors(largest: float, count: int | None = None) -> st.SearchStrategy[np.ndarray]:
    """(3,) or (count, 3) float64 with entries of magnitudes up to `largest`."""
    return arrays(np.float64, (3,) if count is None else (count, 3), elements=st.floats(-largest, largest))


def rotations() -> st.SearchStrategy[np.ndarray]:
    """(3, 3) rotation matrices of any angle."""
    return vectors(4.0).map(rotation_from_vector)


def similarities() -> st.SearchStrategy[Similarity]:
    """Similarities that scale by 0.01 to 100."""
    return st.builds(Similarity, st.floats(0.01, 100.0), rotations(), vectors(10.0))
