"""Small rotations."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from scipy.spatial.transform import Rotation

from odeform.mechanics.rotations import skew, turn, turned

VECTORS = arrays.arrays(float, (3, 3), elements=st.floats(-1.0, 1.0))


@given(VECTORS, VECTORS)
def test_they_agree_with_scipy(start: np.ndarray, vector: np.ndarray) -> None:
    rotation = Rotation.from_rotvec(start).as_matrix()
    expected = Rotation.from_rotvec(vector).as_matrix() @ rotation
    np.testing.assert_allclose(turned(rotation, vector), expected, atol=1e-12)
    small = 0.8 * vector
    np.testing.assert_allclose(turn(Rotation.from_rotvec(small).as_matrix()), small, atol=1e-9)
    np.testing.assert_allclose((skew(vector) @ start[..., None])[..., 0], np.cross(vector, start), atol=1e-15)
