"""A clamped body as a model: what its parameters do, and what it refuses."""

import numpy as np
import pytest
from clamped_bodies import HELD, PLACES, clamped_bar, recording

import odeform
from odeform.errors import InputError
from odeform.identification.release import MarkerLayout, markers_in, recorded_release, released
from odeform.models.clamped import ClampedModel
from odeform.motion.recorded import RecordedMotion
from odeform.types import GaussianSplats, PointCloud

TIP = PointCloud(np.array([[0.015, 0.1, 0.015]], dtype=np.float32))
LATE = 0.999


@pytest.fixture(scope="module")
def bar() -> ClampedModel:
    return clamped_bar()


def hangs(bar: ClampedModel, **parameters: float) -> float:
    """mm that the tip hangs below where it began, once it is still."""
    motion = bar.solve(TIP, {"viscous": 10.0, **parameters})
    return -1e3 * float(motion.vertices(LATE)[0, 2] - motion.vertices(0.0)[0, 2])


def test_a_softer_body_and_a_heavier_one_hang_deeper(bar: ClampedModel) -> None:
    plain = hangs(bar, young=300.0)
    assert hangs(bar, young=150.0) == pytest.approx(2.0 * plain, rel=0.1)
    assert hangs(bar, young=300.0, weight=40.0) > 2.0 * plain > 1.0


def test_damping_takes_the_swing(bar: ClampedModel) -> None:
    free, damped = (bar.solve(TIP, {"viscous": viscous}) for viscous in (0.5, 8.0))
    times = np.linspace(0.5, LATE, 60)
    assert np.ptp(damped.vertices(times)[:, 0, 2]) < 0.2 * np.ptp(free.vertices(times)[:, 0, 2])


def test_it_begins_straight_and_its_clamp_stands_still(bar: ClampedModel) -> None:
    motion = bar.solve()
    assert np.abs(motion.vertices(0.0) - bar.rest.points).max() < 1e-7
    clamped = bar.rest.points[:, 1] < 1e-6
    assert clamped.any()
    assert np.abs(motion.vertices(0.05) - bar.rest.points)[clamped].max() < 1e-7
    centre = motion.pose(0.05)[:3, 3]
    assert centre == pytest.approx((motion.vertices(0.05) - bar.rest.points).mean(axis=0), abs=1e-6)
    assert motion.stats.solver_error_mm is not None
    assert 0.0 < motion.stats.solver_error_mm < 0.05


def test_it_is_kept_in_a_file(bar: ClampedModel, tmp_path) -> None:
    bar.save(path := tmp_path / "bar.safetensors")
    again = odeform.load(path)
    assert isinstance(again, ClampedModel)
    assert np.array_equal(again.solve(TIP).vertices(0.1), bar.solve(TIP).vertices(0.1))


def test_shapes_that_are_not_at_the_body_are_refused(bar: ClampedModel) -> None:
    with pytest.raises(InputError, match="within 20 mm of the body, got 900 mm"):
        bar.solve(PointCloud(np.array([[0.015, 1.0, 0.015]], dtype=np.float32)))
    splats = GaussianSplats(TIP.points, np.eye(3)[None], np.zeros((1, 1, 3)), np.ones(1))
    with pytest.raises(InputError, match="splats"):
        bar.solve(splats)
    with pytest.raises(InputError, match="at least 0 kg"):
        bar.solve(TIP, {"weight": -5.0})


def test_markers_become_a_truth_with_the_models_error_of_what_was_put_in(bar: ClampedModel) -> None:
    true = {"young": 300.0, "viscous": 4.0, "weight": 20.0}
    data = recording(bar, true, lost=(HELD + 6, HELD + 7))
    truth = recorded_release(released(markers_in(data, "bar.npz"), MarkerLayout(**bar.markers)), "bar")
    assert truth.vertices.shape[1:] == (3, 3)
    assert np.isfinite(truth.vertices).all()
    assert truth.vertices[0] == pytest.approx(np.array(list(PLACES["tip"].values())), abs=1e-4)
    shown, times = RecordedMotion(bar.schema, truth), np.arange(0.2, LATE, 0.01)
    off = {
        young: np.abs(bar.solve(truth.rest, {**true, "young": young}).vertices(times) - shown.vertices(times)).max()
        for young in (300.0, 250.0)
    }
    assert off[300.0] < 2e-4  # of the axes that are found in the markers
    assert off[250.0] > 2e-3


def test_two_markers_are_no_plate(bar: ClampedModel) -> None:
    few = {**bar.markers, "tip": dict(list(PLACES["tip"].items())[:2])}
    release = released(markers_in(recording(bar, {}), "bar.npz"), MarkerLayout(**few))
    with pytest.raises(InputError, match="at least three markers"):
        recorded_release(release, "bar.npz")
