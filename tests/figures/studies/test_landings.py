"""Pictures of later landings: which moment they show, and that both shapes are drawn."""

import numpy as np

from odeform.geometry.primitives import octasphere
from odeform.types import Floats, Frames, MotionSequence
from odeform_figures.studies.landings import _column, landing

BALL = octasphere(0.1, 4)
TIMES = np.linspace(0.0, 2.0, 81)


def flattened(by: Floats) -> Frames:
    """(T, N, 3): the ball on the floor, lower by `by` (T,) of its height."""
    scaled = BALL.points[None] * np.stack([np.ones_like(by), np.ones_like(by), 1.0 - by], axis=1)[:, None]
    return scaled + np.stack([0.0 * by, 0.0 * by, 0.1 * (1.0 - by)], axis=1)[:, None]


def bouncing() -> MotionSequence:
    """Up for a fifth of a second, five times; deepest, at each landing, in the middle of three tenths on the floor."""
    phase = np.mod(TIMES, 0.5)
    on_floor = phase < 0.3
    depth = np.where(on_floor, 0.2 * np.sin(np.pi * phase / 0.3), 0.0)
    vertices = flattened(depth) + np.where(on_floor, 0.0, 0.1)[:, None, None] * [0.0, 0.0, 1.0]
    weights = np.full(len(BALL.points), 1.0 / len(BALL.points))
    return MotionSequence(TIMES, vertices.astype(np.float32), BALL.faces, weights, {})


def test_the_first_landing_after_the_window_is_shown_where_it_is_flattest() -> None:
    truth = bouncing()
    assert abs(truth.times[landing(truth, 0.9)] - 1.15) < 0.02
    assert abs(truth.times[landing(truth, 1.1)] - 1.65) < 0.02


def test_without_one_it_is_the_second_landing() -> None:
    truth = bouncing()
    assert abs(truth.times[landing(truth, 10.0)] - 0.65) < 0.02


def test_both_shapes_are_drawn() -> None:
    truth = bouncing()
    picture = np.asarray(_column(truth, 6, truth.vertices[0], "a ball")).astype(int)
    above, below = picture[34:284], picture[284:]
    assert (np.ptp(above, axis=2) > 60).mean() > 0.05  # in colour
    assert (np.ptp(below, axis=2) > 60).mean() < 0.01  # grey
    assert (below.max(axis=2) < 200).mean() > 0.05
