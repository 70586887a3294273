"""A record is shown as it was made."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from odeform.dataset.index import Dataset
from odeform.geometry.rigid import rotation_z
from odeform.motion.recorded import RecordedMotion
from odeform.simulation.scenes.registry import get_scene
from odeform.types import MotionSequence


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


def rigid(turn: float, speed: float) -> RecordedMotion:
    """A box beside the origin that turns at `turn` rad/s about its z axis and moves at `speed` m/s along x."""
    box, times = trimesh.creation.box((0.2, 0.1, 0.3)), np.linspace(0.0, 1.0, 21)
    points = np.add(box.vertices, [1.0, 2.0, 0.5])
    centre = points.mean(axis=0)
    turned = np.stack([(points - centre) @ rotation_z(turn * time).T for time in times])
    moved = np.add(turned, centre) + times[:, None, None] * [speed, 0.0, 0.0]
    sequence = MotionSequence(
        times, moved.astype(np.float32), np.asarray(box.faces, np.int32), np.full(len(points), 1.0 / len(points)), {}
    )
    return RecordedMotion(get_scene("kick").schema, sequence)


def test_a_rigid_motion_is_all_pose() -> None:
    motion, times = rigid(2.0, 0.3), np.array([0.0, 0.33, 0.9])
    poses, rest = motion.pose(times), motion.sequence.vertices[0]
    np.testing.assert_allclose(poses[:, :3, :3], np.stack([rotation_z(2.0 * time) for time in times]), atol=1e-6)
    for time, pose in zip(times, poses, strict=True):
        np.testing.assert_array_equal(motion.pose(float(time)), pose)
        np.testing.assert_allclose(rest @ pose[:3, :3].T + pose[:3, 3], motion.vertices(float(time)), atol=1e-5)
        np.testing.assert_allclose(motion.deformed(float(time)), rest, atol=1e-5)
    assert motion.deformation_bound(0.9) < 1e-5
    assert motion.deformation_rms(times).max() < 1e-5
    assert (motion.rate, motion.end) == (pytest.approx(20.0), 1.0)
    assert not motion.extrapolates(1.0)
    assert motion.unknown == tuple(p.name for p in motion.schema.learned)


def test_deformation_is_weighed_by_the_surface() -> None:
    """Half of a box stretched by 10 mm a second: the mean of its square is over the surface."""
    still = rigid(0.0, 0.0)
    vertices = still.sequence.vertices.copy()
    up = vertices[0, :, 2] > 0.5
    vertices[:, up, 2] += 0.01 * still.sequence.times[:, None].astype(np.float32)
    motion = RecordedMotion(still.schema, replace(still.sequence, vertices=vertices))
    assert motion.deformation_rms(np.array([1.0]))[0] == pytest.approx(0.005, rel=1e-3)  # either half by 5 mm
    assert motion.deformation_bound(1.0) == pytest.approx(0.005, rel=1e-3)


def test_a_record_that_ends_at_rest_is_right_afterwards() -> None:
    moving, lying = rigid(0.0, 0.01), rigid(0.0, 0.0)
    assert not moving.rests
    assert moving.extrapolates(moving.end + 1.0)
    assert lying.rests
    assert not lying.extrapolates(lying.end + 1.0)

    def slower(motion: RecordedMotion, factor: float) -> RecordedMotion:
        return RecordedMotion(motion.schema, replace(motion.sequence, times=factor * motion.sequence.times))

    assert slower(moving, 10.0).rests, "1 mm/s, with a frame in half a second"
    assert not slower(moving, 2.0).rests, "5 mm/s"
    assert not slower(lying, 0.01).rests, "10 ms are too short to tell"
