"""Motions of each kind do what they are named after."""

import numpy as np
import pytest

from odeform.types import Floats, Frames
from odeform_figures.motions.registry import KINDS

QUICK = [name for name in KINDS if name != "drops"]


def moved(name: str, index: int = 3) -> Frames:
    kind = KINDS[name]
    return kind.move(kind.draws(0)[index], kind.times)[0]


def distances(points: Floats) -> Floats:
    """From each tenth vertex to each seventh."""
    return np.linalg.norm(points[::10, None] - points[None, ::7], axis=-1)


@pytest.mark.parametrize("name", QUICK)
def test_all_start_from_one_shape_and_differ_later(name: str) -> None:
    one, other = moved(name), moved(name, 5)
    kind = KINDS[name]
    assert one.shape == other.shape
    assert len(one) == kind.frames
    assert np.isfinite(one).all()
    np.testing.assert_allclose(one[0], other[0], atol=1e-9)
    assert np.abs(one[-1] - other[-1]).max() > 1e-3


@pytest.mark.parametrize("name", QUICK)
def test_every_parameter_matters(name: str) -> None:
    kind = KINDS[name]
    middle = {key: 0.5 * (low + high) for key, (low, high) in kind.ranges.items()}
    base = kind.move(middle, kind.times)[0]
    for key, (low, high) in kind.ranges.items():
        changed = kind.move({**middle, key: middle[key] + 0.1 * (high - low)}, kind.times)[0]
        assert np.abs(changed - base).max() > 5e-4, key


def test_draws_fill_the_ranges_and_repeat() -> None:
    for kind in KINDS.values():
        draws = kind.draws(1)
        assert len(draws) == kind.sequences
        assert draws == kind.draws(1) != kind.draws(2)
        for key, (low, high) in kind.ranges.items():
            values = [row[key] for row in draws]
            assert low <= min(values) < low + 0.15 * (high - low)
            assert high >= max(values) > high - 0.15 * (high - low)


def test_a_throw_is_rigid_and_falls() -> None:
    frames, kind = moved("throw"), KINDS["throw"]
    for points in frames[1:]:
        np.testing.assert_allclose(distances(points), distances(frames[0]), atol=1e-6)
    turned = frames[-1] - frames[-1].mean(axis=0) - (frames[0] - frames[0].mean(axis=0))
    assert np.abs(turned).max() > 0.05
    height = frames.mean(axis=1)[:, 2]
    np.testing.assert_allclose(np.diff(height, 2) * kind.rate**2, -9.81, atol=0.5)


def test_a_bottle_that_rings_stands_fast() -> None:
    frames = moved("vibration")
    foot = frames[0, :, 2] < 1e-3
    assert foot.any()
    assert np.abs(frames[:, foot] - frames[0, foot]).max() < 1e-4
    assert np.abs(frames[-8:] - frames[0]).max() < np.abs(frames[:8] - frames[0]).max()


def test_a_rope_keeps_its_length_and_hangs_from_its_top() -> None:
    frames = moved("pendulum")
    top, last = frames.shape[1] - 2, frames.shape[1] - 1
    assert np.ptp(frames[:, top], axis=0).max() == 0.0
    assert np.ptp(frames[:, last, 0]) > 0.1
    rings = frames[:, :-2].reshape(len(frames), 60, 14, 3).mean(axis=2)
    length = np.linalg.norm(np.diff(rings, axis=1), axis=-1).sum(axis=1)
    np.testing.assert_allclose(length, 0.5, rtol=2e-3)


def test_a_dog_walks_ahead_on_legs_that_swing() -> None:
    frames = moved("walk")
    ahead = frames.mean(axis=1)[:, 0]
    assert ahead[-1] > ahead[0] + 0.05
    body = frames - frames.mean(axis=1, keepdims=True)
    low = frames[0, :, 2] < 0.04
    swing = np.ptp(body[..., 0], axis=0)
    assert np.median(swing[low]) > 3.0 * np.median(swing[frames[0, :, 2] > 0.2])


@pytest.mark.slow
def test_a_ball_is_dropped_and_lands() -> None:
    frames = moved("drops")
    assert frames.shape[0] == 21
    assert frames[0, :, 2].min() > 0.3
    assert np.abs(frames[:, :, 2].min(axis=1)).min() < 5e-3
