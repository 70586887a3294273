"""Points as sums of modes, and which of them Rerun is shown."""

import numpy as np
import pytest

from odeform_viz.recording import modes
from odeform_viz.recording.modes import EXACT, ModeEncoder, decode
from odeform_viz.recording.shown_points import AT_ONCE, SMALLEST, ShownBudget

REST = np.random.default_rng(0).normal(scale=0.1, size=(300, 3)).astype(np.float32)


def _motion(count: int, rank: int) -> np.ndarray:
    """(count, N, 3) frames of a motion of that many modes."""
    rng = np.random.default_rng(1)
    shapes, factors = rng.normal(scale=0.01, size=(rank, *REST.shape)), rng.normal(size=(count, rank))
    return (REST + np.einsum("tk,kni->tni", factors, shapes)).astype(np.float32)


def test_a_motion_takes_as_many_modes_as_it_has_and_is_exact() -> None:
    encoder, known = ModeEncoder(REST), []
    for points in _motion(40, 5):
        encoded = encoder.encode(points)
        assert encoded is not None
        coefficients, mode = encoded
        known += [mode] if mode is not None else []
        assert len(coefficients) == len(known)
        np.testing.assert_allclose(decode(REST, np.array(known), coefficients), points, rtol=0.0, atol=EXACT)
    assert len(known) == 5


def test_a_body_at_rest_takes_none() -> None:
    encoded = ModeEncoder(REST).encode(REST)
    assert encoded is not None
    assert encoded[1] is None
    np.testing.assert_array_equal(decode(REST, np.zeros((0, *REST.shape)), encoded[0]), REST)


def test_what_modes_cannot_express_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    encoder = ModeEncoder(REST)
    assert encoder.encode(np.where(REST[3] == REST, np.nan, REST)) is None
    monkeypatch.setattr(modes, "MOST", 2)
    limited = ModeEncoder(REST)
    assert [limited.encode(points) is None for points in _motion(4, 4)] == [False, False, True, True]


def test_small_changes_are_shown_while_there_is_room_and_large_ones_longer() -> None:
    budget, size = ShownBudget(), AT_ONCE // 10
    assert not budget.allows(0.5 * SMALLEST, size)
    assert budget.allows(SMALLEST, size)
    for _ in range(7):
        assert budget.allows(1.0, size)
    assert not budget.allows(2.0 * SMALLEST, size)  # a fifth is left
    assert budget.allows(6.0 * SMALLEST, size)
    assert not budget.allows(float("nan"), size)
    while budget.allows(1.0, size):
        pass
    for _ in range(AT_ONCE):
        budget.next_frame()
    assert budget.allows(SMALLEST, size)
