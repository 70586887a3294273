import numpy as np
import pytest

from odeform.errors import InputError
from odeform.identification.observation import Observation, View, observe
from odeform.schema import Parameter, Schema, Window
from odeform.types import MotionSequence

SCHEMA = Schema("drop", (Parameter("mass", "kg", 0.1, 1.0, 0.5),), Window(0.0, 0.5, 10.0))
SQUARE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])


def rising(frames: int = 21, rate: float = 40.0) -> MotionSequence:
    times = np.arange(frames) / rate
    vertices = SQUARE + times[:, None, None] * np.array([0.0, 0.0, 1.0])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return MotionSequence(times, vertices, faces, np.full(4, 0.25), {"mass": 0.3}, "rising")


def test_everything_is_observed_on_the_frames_of_the_window() -> None:
    observed = observe(rising(), SCHEMA, View())
    assert np.allclose(observed.times, [0.1, 0.2, 0.3, 0.4, 0.5])
    assert np.allclose(observed.positions[..., 2], observed.times[:, None])
    assert np.array_equal(observed.rest, SQUARE)


def test_a_random_part_is_fixed_by_the_seed() -> None:
    view = View(points=7, frames=3, noise_mm=1.0, seed=5)
    observed, again = observe(rising(), SCHEMA, view), observe(rising(), SCHEMA, view)
    assert observed.positions.shape == (3, 7, 3)
    assert np.array_equal(observed.positions, again.positions)
    assert not np.array_equal(observed.rest, observe(rising(), SCHEMA, View(7, 3, 1.0, seed=6)).rest)
    # points of the square that are not vertices, and move with it
    assert np.allclose(observed.rest[:, 2], 0.0)
    assert (observed.rest[:, :2] > 0.0).all()
    assert (observed.rest[:, :2] < 1.0).all()
    error = observed.positions - observed.rest - observed.times[:, None, None] * np.array([0.0, 0.0, 1.0])
    assert 0.5e-3 < error.std() < 1.5e-3
    assert observed.noise_mm == pytest.approx(1.0, rel=1e-3)


def test_subsampling_keeps_both_ends() -> None:
    thin = observe(rising(), SCHEMA, View()).subsampled(points=2, frames=3)
    assert np.allclose(thin.times, [0.1, 0.3, 0.5])
    assert np.array_equal(thin.rest, SQUARE[[0, 3]])


@pytest.mark.parametrize(
    "wrong",
    [
        {"positions": np.zeros((2, 4, 3))},
        {"positions": np.full((1, 4, 3), np.nan)},
        {"times": np.array([-1.0])},
        {"noise_mm": 0.0},
        {"rest": np.zeros((0, 3)), "positions": np.zeros((1, 0, 3))},
    ],
)
def test_an_invalid_observation_is_rejected(wrong: dict) -> None:
    sound = {"rest": SQUARE, "times": np.array([0.1]), "positions": SQUARE[None]}
    Observation(**sound)
    with pytest.raises(InputError, match="observation"):
        Observation(**{**sound, **wrong})


@pytest.mark.parametrize("wrong", [{"points": 0}, {"frames": 0}, {"noise_mm": -1.0}, {"seed": -1}])
def test_an_invalid_view_is_rejected(wrong: dict) -> None:
    with pytest.raises(InputError, match="view"):
        View(**wrong)
