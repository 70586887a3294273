"""A record is shown as it was made."""

import numpy as np
import pytest

from odeform.dataset.index import Dataset
from odeform.motion.recorded import RecordedMotion


@pytest.fixture(scope="module")
def motion(dataset: Dataset) -> RecordedMotion:
    return RecordedMotion(dataset.schema, next(dataset.sequences("test")))


def test_its_frames_are_the_sequence(motion: RecordedMotion) -> None:
    times = motion.sequence.times[::37]
    np.testing.assert_allclose(motion.vertices(times), motion.sequence.vertices[::37], atol=1e-7)
    np.testing.assert_array_equal(motion.vertices(motion.end + 0.3), motion.vertices(motion.end))
    assert motion.extrapolates(motion.end + 0.3)


def test_between_frames_it_is_what_a_finer_record_has(motion: RecordedMotion) -> None:
    fine = motion.sequence
    coarse = RecordedMotion(motion.schema, fine.until(motion.end, every=2))
    off = coarse.vertices(fine.times[1:-2:2]) - fine.vertices[1:-2:2]
    assert np.sqrt((off**2).mean()) < 1e-4


def test_pose_and_deformation_make_the_motion(motion: RecordedMotion) -> None:
    for time in (0.0, 0.0171, 0.5):
        pose = motion.pose(time)
        np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
        moved = motion.deformed(time) @ pose[:3, :3].T + pose[:3, 3]
        np.testing.assert_allclose(moved, motion.vertices(time), atol=1e-6)
    rms = motion.deformation_rms(np.array([0.0, 0.012]))
    assert rms[0] == pytest.approx(0.0, abs=1e-7)
    assert 0.0 < rms[1] <= motion.deformation_bound(0.012)


def test_whose_parameters_it_is_of(motion: RecordedMotion) -> None:
    assert motion.of(motion.parameters)
    assert not motion.of({**motion.parameters, "mass": motion.parameters["mass"] * 1.03})
