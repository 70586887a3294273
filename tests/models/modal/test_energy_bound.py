"""Motions of bodies that deform farther than their linear law holds."""

import numpy as np
import pytest

import odeform
from odeform.models.base import Predictor
from odeform.models.modal import energy_bound

SOFT = {  # a cat of half its stiffness that collapses when it lands, and spun at 70 rad/s afterwards
    "object": "cat",
    "height": 0.298001,
    "turn_x": -136.5826,
    "turn_y": 87.32333,
    "turn_z": 159.57345,
    "velocity_x": 0.893359,
    "velocity_y": 1.142126,
    "velocity_z": 1.39857,
    "spin_x": 4.123697,
    "spin_y": -3.243752,
    "spin_z": 7.568278,
    "mass": 1.325951,
    "young": 36.915316,
}
USUAL = SOFT | {"mass": 1.0, "young": 75.0}
TIMES = np.arange(0.0, 1.6, 0.01)


@pytest.fixture(scope="module")
def thrown() -> Predictor:
    return odeform.load("contact-force").under("throw")


def spins(motion: odeform.Motion) -> np.ndarray:
    """(T - 1,) rad/s between `TIMES`."""
    turns = motion.pose(TIMES)[:, :3, :3]
    steps = turns[1:] @ turns[:-1].swapaxes(1, 2)
    return np.arccos(np.clip(0.5 * (np.trace(steps, axis1=1, axis2=2) - 1.0), -1.0, 1.0)) / np.diff(TIMES)


def test_a_body_that_would_gain_energy_ends_there_in_words(thrown: Predictor, monkeypatch: pytest.MonkeyPatch) -> None:
    motion = thrown.solve(parameters=SOFT)
    assert spins(motion).max() < 55.0
    assert motion.stats.status == energy_bound.STATUS
    assert 0.6 < motion.last_good < 0.9
    after = motion.vertices(np.array([motion.last_good, 1.2, 1.5]))
    assert np.array_equal(after[0], after[1])
    assert np.array_equal(after[0], after[2])
    monkeypatch.setattr(energy_bound, "MOST", np.inf)
    assert spins(thrown.solve(parameters=SOFT | {"height": 0.2980011})).max() > 65.0


def test_the_end_does_not_depend_on_what_was_asked_for(thrown: Predictor) -> None:
    late, stepwise = (thrown.solve(parameters=SOFT) for _ in range(2))
    late.vertices(1.5)
    for time in (0.2, 0.713, 0.745, 0.7531, 0.9, 0.3):
        np.testing.assert_array_equal(stepwise.vertices(time), late.vertices(time))
    stepwise.vertices(1.5)
    assert stepwise.last_good == late.last_good


def test_of_many_motions_each_ends_as_it_does_alone(thrown: Predictor) -> None:
    names = [name for name in SOFT if name != "object"]
    batch = thrown.solve_batch(
        {"object": "cat", **{name: np.array([SOFT[name]] * 2) for name in names}, "spin_x": np.array([4.123697, 1.0])}
    )
    times = np.array([0.5, 0.745, 1.2])
    for index, spin in enumerate((4.123697, 1.0)):
        alone = thrown.solve(parameters=SOFT | {"spin_x": spin})
        np.testing.assert_allclose(batch.vertices(times)[index], alone.vertices(times), atol=1e-6)


def test_sound_motions_are_not_touched(thrown: Predictor, monkeypatch: pytest.MonkeyPatch) -> None:
    watched = thrown.solve(parameters=USUAL)
    frames = watched.vertices(TIMES)
    assert watched.stats.status == "ok"
    assert np.isinf(watched.last_good)
    monkeypatch.setattr(energy_bound, "MOST", np.inf)
    np.testing.assert_array_equal(
        odeform.load("contact-force").under("throw").solve(parameters=USUAL).vertices(TIMES), frames
    )
