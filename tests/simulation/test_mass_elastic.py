import numpy as np
import pytest

from odeform.geometry.rigid import best_rigid, vector_from_rotation
from odeform.simulation.objects.ball import RADIUS
from odeform.simulation.physics import GRAVITY
from odeform.simulation.scenes.mass_elastic import HEIGHT, REST_SPEED, REST_TIME, SCENE, SCHEMA, simulate
from odeform.types import Floats, MotionSequence

pytestmark = pytest.mark.slow

LIGHT_AND_SOFT = {"mass": 0.2, "bending": 0.3}
CONTACT_BEGINS = np.sqrt(2.0 * (HEIGHT - RADIUS) / GRAVITY)


@pytest.fixture(scope="module")
def drop() -> MotionSequence:
    return simulate(LIGHT_AND_SOFT, step=1e-3, resolution=5)


def centre(sequence: MotionSequence) -> Floats:
    return np.einsum("n,tni->ti", sequence.weights, sequence.vertices.astype(float))


def test_falls_as_a_point_does(drop: MotionSequence) -> None:
    falling = drop.times < CONTACT_BEGINS - 6e-3
    assert falling.sum() == 34
    height = HEIGHT - 0.5 * GRAVITY * drop.times**2
    assert np.abs(centre(drop)[falling, 2] - height[falling]).max() < 1e-7
    shape = drop.vertices - centre(drop)[:, None]
    assert np.abs(shape[falling] - shape[0]).max() < 1e-7
    # the simulator takes over without a jump
    taken_over = (drop.times < CONTACT_BEGINS) & ~falling
    assert taken_over.any()
    assert np.abs(centre(drop)[taken_over, 2] - height[taken_over]).max() < 1e-4
    assert np.abs(shape[taken_over] - shape[0]).max() < 1e-5


def test_bounces_on_its_line(drop: MotionSequence) -> None:
    moved = centre(drop)
    assert np.abs(moved[:, 1]).max() < 1e-6
    # along x no symmetry holds it: MuJoCo's friction cone has four sides and the ball three
    assert np.abs(moved[:, 0]).max() < 1e-3
    rotation, _ = best_rigid(drop.vertices[0].astype(float), drop.vertices, drop.weights)
    turn = vector_from_rotation(rotation)
    assert np.abs(turn[:, [0, 2]]).max() < 1e-5
    assert np.abs(turn[:, 1]).max() < 0.01
    landed = drop.times > CONTACT_BEGINS
    assert moved[landed, 2].max() > RADIUS + 0.02


def test_ends_at_rest_on_the_floor(drop: MotionSequence) -> None:
    assert CONTACT_BEGINS < drop.times[-1] < 5.0
    last = round(REST_TIME * SCHEMA.window.rate)
    velocity = np.diff(drop.vertices[-last:].astype(float), axis=0) * SCHEMA.window.rate
    assert np.sqrt(np.einsum("n,tni->t", drop.weights, velocity**2)).max() < REST_SPEED
    assert RADIUS - 0.01 < centre(drop)[-1, 2] < RADIUS
    assert -1e-3 < drop.vertices[-1, :, 2].min() < 1e-3
    assert drop.vertices[..., 2].min() > -5e-3


def test_frames_lie_on_the_grid(drop: MotionSequence) -> None:
    assert np.allclose(drop.times, np.arange(len(drop.times)) / 120.0, rtol=0.0, atol=1e-12)
    assert drop.vertices.shape == (len(drop.times), 102, 3)
    assert drop.vertices.dtype == np.float32


def test_frames_asked_for_do_not_change_the_motion() -> None:
    """A rate that divides the steps, one that does not, and a multiple of both."""
    motions = {rate: simulate(LIGHT_AND_SOFT, rate=rate, step=2e-3, resolution=4) for rate in (100.0, 120.0, 600.0)}
    for rate, every in ((100.0, 6), (120.0, 5)):
        plain, fine = motions[rate].vertices, motions[600.0].vertices[::every]
        assert len(plain) == len(fine) > 100
        assert np.abs(plain - fine).max() < 1e-6


def test_what_is_shown_hangs_where_the_drop_begins(drop: MotionSequence) -> None:
    shown, begun = np.asarray(SCENE.rest_mesh().points), drop.vertices[0]
    assert np.allclose(shown.mean(axis=0), [0.0, 0.0, HEIGHT], atol=1e-9)
    assert np.allclose(centre(drop)[0], [0.0, 0.0, HEIGHT], atol=1e-6)
    assert np.linalg.norm(begun - centre(drop)[0], axis=1).mean() == pytest.approx(RADIUS, abs=1e-6)


def test_the_impact_is_within_the_window() -> None:
    assert SCHEMA.impact is not None
    begin, end = SCHEMA.impact
    assert SCHEMA.window.start < begin < CONTACT_BEGINS < end < SCHEMA.window.stop
