"""Pose and deformation, read off points of which the motion is known."""

import numpy as np
import pytest
import trimesh

from odeform.geometry.rigid import rotation_from_vector, rotation_z
from odeform.motion.base import SolveStats
from odeform.motion.point_motion import MeanMotion, PointFrame, PointMotion, evaluate_probes
from odeform.simulation.scenes.registry import get_scene
from odeform.types import Floats, Frames, Mesh

ANCHOR = np.array([0.0, 0.0, 0.1])
FRAME = PointFrame((0.0, 0.0, 0.1), gyration_radius=0.1, reach=0.1, largest=10.0, scale=1.0, part_scale=1.0)
STILL = MeanMotion(np.array([0.0, 1.0, 2.0]), np.zeros((3, 3)))


def ball(level: int = 3) -> Mesh:
    sphere = trimesh.creation.icosphere(level, 0.1)
    return Mesh(np.add(sphere.vertices, ANCHOR), np.asarray(sphere.faces))


class Rolling:
    """Turns by `t` radians about y, goes `t` metres along x, and is stretched by `t` `stretch` along z."""

    def __init__(self, rest: Floats, stretch: float) -> None:
        self.rest, self.stretch = rest, stretch

    def stats(self) -> SolveStats:
        return SolveStats("known", 0, 0, 0, "ok", 0.0, lambda: None)

    def displacements(self, times: Floats) -> Frames:
        out = []
        for time in times:
            deformed = self.rest * [1.0, 1.0, 1.0 + time * self.stretch]
            turned = deformed @ rotation_from_vector(np.array([0.0, time, 0.0])).T
            out.append(np.add(turned, (time, 0.0, 0.0)) - self.rest)
        return np.array(out, dtype=np.float32)


def rolling(stretch: float, azimuth: float = 0.0, mean: MeanMotion = STILL) -> PointMotion:
    schema, body = get_scene("kick").schema, ball()
    parameters = schema.complete({"azimuth": azimuth})
    rest, probes = (body.points - ANCHOR) @ rotation_z(azimuth), evaluate_probes(body, ANCHOR)
    moved, seen = Rolling(rest, stretch), Rolling(probes.points, stretch)
    return PointMotion(schema, parameters, body, FRAME, mean, probes, moved, seen)


@pytest.mark.parametrize("azimuth", [0.0, 0.8])
def test_a_rigid_motion_is_all_pose(azimuth: float) -> None:
    motion, turn = rolling(0.0, azimuth), rotation_z(azimuth)
    pose = motion.pose(0.6)
    expected = turn @ rotation_from_vector(np.array([0.0, 0.6, 0.0])) @ turn.T
    np.testing.assert_allclose(pose[:3, :3], expected, atol=1e-6)
    np.testing.assert_allclose(pose[:3, :3] @ ANCHOR + pose[:3, 3], ANCHOR + turn @ [0.6, 0.0, 0.0], atol=1e-6)
    assert np.abs(motion.local(np.array([0.2, 0.6]))).max() < 1e-6
    assert motion.deformation_bound(0.6) < 1e-6
    assert motion.deformation_rms(np.array([0.6]))[0] < 1e-6


def test_a_deformation_is_told_from_the_pose() -> None:
    motion, stretch = rolling(0.1), 0.05
    np.testing.assert_allclose(motion.pose(0.5)[:3, :3], rotation_from_vector(np.array([0.0, 0.5, 0.0])), atol=1e-4)
    np.testing.assert_allclose(motion.local(0.5)[:, 2], stretch * (ball().points[:, 2] - 0.1), atol=1e-4)
    assert motion.deformation_bound(0.5) == pytest.approx(0.1 * stretch, rel=1e-2)
    # the mean square of z on a sphere is a third of its radius squared; probes stand for shares of the surface
    assert motion.deformation_rms(np.array([0.5]))[0] == pytest.approx(0.1 * stretch / np.sqrt(3.0), rel=3e-2)


def test_the_mean_motion_is_added_and_held() -> None:
    times = np.linspace(0.0, 1.0, 11)
    mean = MeanMotion(times, np.outer(times, [0.0, 0.0, 1.0]))
    motion = rolling(0.0, mean=mean)
    np.testing.assert_allclose(motion.vertices(0.55) - rolling(0.0).vertices(0.55), [[0.0, 0.0, 0.55]] * 642, atol=1e-6)
    np.testing.assert_allclose(mean.at(np.array([0.0, 5.0])), [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]], atol=1e-12)


def test_probes_are_spread_and_share_the_surface() -> None:
    probes = evaluate_probes(ball(), ANCHOR, 60)
    assert probes.areas.sum() == pytest.approx(1.0)
    assert probes.areas.max() < 3.0 / 60
    apart = np.linalg.norm(probes.points[:, None] - probes.points, axis=2) + np.eye(60)
    assert apart.min() > 0.02
    assert len(evaluate_probes(ball(0), ANCHOR).points) == 12


def test_far_points_are_taken_for_nearer_ones_and_wild_motions_bounded() -> None:
    inputs = FRAME.inputs(np.array([[0.1, 0.0, 0.0], [0.0, 50.0, 0.0], [0.0, 0.0, 1e30]]))
    np.testing.assert_allclose(inputs, [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]], rtol=1e-6)
    moved = np.array([[[12.0, 0.0, 0.0], [0.0, 1e3, 0.0]]])
    bounded = FRAME.bounded(moved)
    assert np.array_equal(bounded[0, 0], moved[0, 0])
    assert bounded[0, 1, 1] == pytest.approx(15.0)
