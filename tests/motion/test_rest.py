"""When a body has come to rest."""

import numpy as np
import pytest

import odeform
from odeform.motion.rest import rests_from


def test_a_pushed_cat_rests_within_a_second_and_a_ball_that_rolls_does_not() -> None:
    motion = odeform.load("contact-force").solve(parameters={"object": "cat"})
    begin = rests_from(motion, 1.0)
    assert begin is not None
    assert 0.1 < begin < 0.9
    points = motion.vertices(np.array([0.5 * begin, begin, begin + 0.03, 1.0]))
    away = np.sqrt(((points - points[-1]) ** 2).sum(axis=2)).max(axis=1)
    assert away[0] > 1.5e-3
    assert away[1:].max() < 1.5e-3
    assert rests_from(motion, 0.25) is None
    assert rests_from(odeform.load("kick").solve(), 1.0) is None


def test_a_body_that_nobody_pushes_rests_from_the_start() -> None:
    still = {"object": "cat", "force_x": 0.0, "force_y": 0.0, "force_z": 0.0}
    assert rests_from(odeform.load("contact-force").solve(parameters=still), 0.5) == pytest.approx(0.0)
