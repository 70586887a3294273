"""Beyond the window: nothing changes before its end, and what follows is one bounded, continuous motion."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from odeform.dataset.index import Dataset
from odeform.dataset.training_data import prepare
from odeform.models.base import Predictor
from odeform.models.continuation import PREFIX, Dynamics, continued
from odeform.models.latent.model import LatentModel
from odeform.models.registry import load
from odeform.models.training.continuation import fit_dynamics
from odeform.motion.base import SolveStats
from odeform.schema import REACH, Schema, Window
from odeform.types import Floats

RATE, GRAVITY = 60.0, np.array([0.3, 0.0, -5.0])
WINDOW = Window(0.0, 0.5, RATE, REACH)


def flight(times: Floats, speed: float = 1.0) -> Floats:
    """(T, 6 + 2): thrown, and turning at a constant rate."""
    shift = times[:, None] * [0.2, speed, 2.0] + 0.5 * times[:, None] ** 2 * GRAVITY
    return np.concatenate([shift, speed * times[:, None] * [3.0, 0.0, -1.0], np.zeros((len(times), 2))], axis=1)


@dataclass(frozen=True)
class Given:
    """A motion that is known up to `last_good`."""

    last_good: float = np.inf

    @property
    def stats(self) -> SolveStats:
        return SolveStats("none", 0, 0, 0, "ok", 0.0, lambda: None)

    def reduced(self, times: Floats) -> Floats:
        return flight(np.minimum(times, self.last_good))


@pytest.fixture(scope="module")
def flying() -> Dynamics:
    """Fitted to nothing but free flight."""
    speeds = np.linspace(-1.0, 1.0, 7)
    return fit_dynamics(
        speeds[:, None], np.stack([flight(WINDOW.times, speed) for speed in speeds]), gyration_radius=0.1
    )


@pytest.fixture(scope="module")
def pair(dataset: Dataset, predictors: dict[str, Predictor]) -> tuple[LatentModel, LatentModel]:
    """The trained model as older checkpoints have it, and continued."""
    model = predictors["odeform"]
    assert isinstance(model, LatentModel)
    checkpoint = model.checkpoint
    data = prepare(dataset, model.space.basis.modes)
    dynamics = fit_dynamics(data.theta["train"], data.reduced["train"], data.space.gyration_radius)
    without = {name: array for name, array in checkpoint.arrays.items() if not name.startswith(PREFIX)}

    def at(reach: float) -> Schema:
        return replace(checkpoint.schema, window=replace(checkpoint.schema.window, reach=reach))

    return (
        LatentModel(replace(checkpoint, arrays=without, schema=at(0.0))),
        LatentModel(replace(checkpoint, arrays={**without, **dynamics.arrays()}, schema=at(REACH))),
    )


def test_free_flight_goes_on_exactly(flying: Dynamics) -> None:
    assert np.allclose(flying.gravity, GRAVITY / RATE**2, rtol=1e-9)
    motion = continued(Given(), flying, np.zeros(1), WINDOW)
    times = np.linspace(0.0, 1.3, 97)
    assert np.abs(motion.reduced(times) - flight(times)).max() < 1e-9


def test_a_motion_that_failed_stays(flying: Dynamics) -> None:
    motion = continued(Given(last_good=0.4), flying, np.zeros(1), WINDOW)
    assert motion.last_good == 0.4
    assert np.array_equal(motion.reduced(np.array([0.45, 0.7, 1.0])), flight(np.full(3, 0.4)))


def test_the_window_is_as_it_was(pair: tuple[LatentModel, LatentModel]) -> None:
    stopped, moving = (model.solve(None, {"mass": 0.6}) for model in pair)
    window = pair[0].schema.window
    inside = np.linspace(0.0, window.stop, 333)
    assert np.array_equal(moving.vertices(inside), stopped.vertices(inside))
    # together with later times too
    later = np.append(inside, window.stop * np.array([1.2, 3.0]))
    assert np.array_equal(moving.vertices(later)[:333], stopped.vertices(later)[:333])
    assert np.abs(moving.vertices(later)[-2:] - stopped.vertices(later)[-2:]).max() > 1e-5


def test_it_goes_on_without_a_jump(pair: tuple[LatentModel, LatentModel]) -> None:
    motion, window = pair[1].solve(None, {"force": 140.0}), pair[1].schema.window
    for end in (window.stop, window.stop + 3.0 / window.rate, window.stop + REACH * window.stop):
        around = motion.vertices(end + np.array([-1e-7, 0.0, 1e-7]))
        assert np.abs(np.diff(around, axis=0)).max() < 1e-5


def test_what_else_is_asked_changes_nothing(pair: tuple[LatentModel, LatentModel]) -> None:
    late = pair[1].schema.window.stop * np.linspace(1.001, 2.0, 40)
    motion = pair[1].solve(None, {"mass": 0.9}).trajectory
    first = motion.reduced(late[5:6])
    together = motion.reduced(late)
    assert np.array_equal(first[0], together[5])
    other = pair[1].solve(None, {"mass": 0.9}, until=10.0).trajectory
    backwards = np.concatenate([other.reduced(time[None]) for time in late[::-1]])
    assert np.array_equal(backwards[::-1], together)


@pytest.mark.parametrize("reach", [1.0, 10.0])
def test_it_is_bounded_at_any_time(pair: tuple[LatentModel, LatentModel], reach: float) -> None:
    model = pair[1]
    window, (shift, deformation) = model.schema.window, model.space.largest
    for parameters in model.schema.corners(reach):
        motion = model.solve(None, parameters)
        times = window.stop * np.array([1.5, 10.0, 1e300])
        assert np.isfinite(motion.vertices(times)).all()
        assert np.linalg.norm(motion.pose(times)[:, :3, 3], axis=1).max() < np.inf
        clock = window.soft_clamped(times)
        y = model.space.bounded(motion.trajectory.reduced(clock), window.passed(clock))
        assert (np.linalg.norm(y[:, :3], axis=1) <= 1.3 * shift * window.passed(clock) + 1e-9).all()
        assert np.linalg.norm(y[:, 6:], axis=1).max() <= 1.3 * deformation + 1e-9
        assert np.array_equal(y[1], y[2])  # the clock has stopped


def test_contacts_alone_change_a_flight(pair: tuple[LatentModel, LatentModel]) -> None:
    dynamics = pair[1].dynamics
    assert dynamics is not None
    motion, window, theta = pair[1].solve(None, {"mass": 0.6}), pair[1].schema.window, np.zeros((1, 4))
    before, now = motion.trajectory.reduced(window.stop - np.array([1.0, 0.0]) / window.rate)[:, None]
    low, high = (dynamics.contact_height + height - now[:, 2] for height in (-dynamics.width, 1.0))
    for lifted, changed in ((high, False), (low, True)):
        states = [state + np.eye(1, state.shape[1], 2) * lifted for state in (before, now)]
        added = dynamics.next(*states, theta) - dynamics.flight(*states)
        assert bool(added[:, :6].any()) == bool(added[:, 6:].any()) == changed


@pytest.fixture
def drop() -> Predictor:
    return load("mass-elastic")


def test_a_continuation_of_an_earlier_version_is_left_out(drop: Predictor) -> None:
    known, later = drop.checkpoint, drop.schema.window.stop * np.array([1.0, 1.4, 1e9])
    arrays = {name: array for name, array in known.arrays.items() if not name.startswith(PREFIX)}
    older = LatentModel(replace(known, arrays={**arrays, f"{PREFIX}centers": np.zeros((3, 2), np.float32)}))
    assert older.dynamics is None
    assert older.schema.window.reach == 0.0
    assert older.schema.window.soft_clamped(later[2:])[0] == pytest.approx(1.05 * drop.schema.window.stop)
    assert np.array_equal(older.solve().vertices(later[:1]), drop.solve().vertices(later[:1]))


def test_older_checkpoints_have_none(drop: Predictor) -> None:
    known, window = drop.checkpoint, drop.schema.window
    arrays = {name: array for name, array in known.arrays.items() if not name.startswith(PREFIX)}
    older = LatentModel(replace(known, arrays=arrays, schema=replace(known.schema, window=replace(window, reach=0.0))))
    assert older.dynamics is None
    assert older.schema.window.soft_clamped(np.array([1e9]))[0] == pytest.approx(1.05 * drop.schema.window.stop)
    assert np.array_equal(older.solve().vertices(window.times), drop.solve().vertices(window.times))


def test_wrong_arrays_are_refused(flying: Dynamics) -> None:
    arrays = flying.arrays()
    read = Dynamics.from_arrays(arrays, 8, 1)
    assert read is not None
    assert np.allclose(read.inverse_lengths, flying.inverse_lengths, rtol=1e-6)
    assert read.pose.inputs.shape == flying.pose.inputs.shape
    with pytest.raises(ValueError, match="shape"):
        Dynamics.from_arrays(arrays, 9, 1)
    with pytest.raises(ValueError, match="finite"):
        Dynamics.from_arrays({**arrays, f"{PREFIX}gravity": np.full(3, np.nan)}, 8, 1)
