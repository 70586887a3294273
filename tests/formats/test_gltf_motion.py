"""Animated `.glb` files, evaluated by a player of the tests' own."""

from pathlib import Path

import numpy as np
import pytest
from gltf_player import Player

from odeform.errors import InputError
from odeform.formats.colors import to_linear
from odeform.formats.reading import read_geometry
from odeform.formats.writing import write_motion
from odeform.geometry.primitives import octasphere
from odeform.geometry.region import Sphere
from odeform.geometry.rigid import rotation_from_vector
from odeform.geometry.shape import fit_to
from odeform.geometry.similarity import Similarity
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.types import Floats, Mesh, PointCloud

TIMES = np.linspace(0.0, 1.2, 19)


def y_up(points: Floats) -> Floats:
    return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)


@pytest.mark.parametrize("checkpoint", ["kick", "mass-elastic/pod-rbf", "contact-force"])
def test_every_frame_has_the_vertices_of_the_motion(checkpoint: str, tmp_path: Path) -> None:
    motion = load(checkpoint).solve()
    times = motion.schema.window.times
    write_motion(motion, times, tmp_path / "a.glb")
    player = Player(tmp_path / "a.glb")
    assert np.allclose(player.times, times, atol=1e-6)
    for frame, time in enumerate(times):
        off = player.vertices(frame) - y_up(motion.vertices(float(time)))
        assert np.linalg.norm(off, axis=1).max() <= 1e-5
    targets = player.tree["meshes"][0]["primitives"][0]["targets"]
    assert 0 < len(targets) < len(times)
    assert np.abs(motion.deformation_rms(times)).max() > 1e-4


def test_what_has_to_be_known_is_in_the_file(kick: Predictor, tmp_path: Path) -> None:
    motion = kick.solve(parameters={"mass": 7.0})
    write_motion(motion, TIMES, tmp_path / "a.glb")
    extras = Player(tmp_path / "a.glb").tree["asset"]["extras"]
    assert extras["status"] == motion.status
    assert extras["parameters"] == motion.parameters
    assert any("mass = 7 kg is outside the trained range" in note for note in extras["notes"])
    assert any("outside the trained window, 0 to 1 s" in note for note in extras["notes"])


def test_a_colored_part_in_the_units_of_its_file_with_the_remainder(kick: Predictor, tmp_path: Path) -> None:
    ball = octasphere(0.1, 3)
    table = Mesh(np.array([[-1, -1, -0.01], [1, -1, -0.01], [0, 1, -0.01]], np.float32), np.array([[0, 1, 2]]))
    points = np.concatenate([ball.points + np.float32([0.0, 0.0, 0.1]), table.points])
    faces = np.concatenate([ball.faces, table.faces + len(ball.points)])
    colors = np.random.default_rng(0).integers(0, 256, (len(faces), 1, 3)).repeat(3, axis=1).astype(np.uint8)
    away = Similarity(3.28, rotation_from_vector(np.array([1.5, 0.1, -0.2])), np.array([2.0, -6.0, 1.0]))
    file = away.shape(Mesh(points, faces, colors))
    region = Sphere(np.array([0.0, 0.0, 0.105]), 0.1052).transformed(away)
    fit = fit_to(file, kick.rest, region, transform=away.inverse)
    motion = kick.solve(fit.geometry)
    write_motion(motion, TIMES, tmp_path / "a.glb", fit)
    player = Player(tmp_path / "a.glb")
    assert isinstance(fit.geometry, Mesh)
    corners = fit.geometry.faces.ravel()
    for mesh, shape in zip(player.tree["meshes"], (fit.geometry, fit.remainder), strict=True):
        (part,) = mesh["primitives"]
        assert isinstance(shape, Mesh)
        assert shape.colors is not None
        written = player.array(part["attributes"]["COLOR_0"])[player.array(part["indices"]).astype(int)]
        assert np.allclose(written, to_linear(shape.colors.reshape(-1, 3) / 255.0), atol=1e-6)
    indices = player.array(player.tree["meshes"][0]["primitives"][0]["indices"]).astype(int)
    # the root turns the scene's up to y: no matter how the file lay, up is up
    upright = Similarity(3.28, np.eye(3), np.zeros(3))
    shift = player.vertices(0)[indices[0]] - y_up(upright.points(motion.vertices(0.0)[corners[0]]))
    for frame, time in enumerate(TIMES):
        expected = y_up(upright.points(motion.vertices(float(time))[corners])) + shift
        assert np.abs(player.vertices(frame)[indices] - expected).max() <= 3.28e-5
    assert np.allclose(player.vertices(0, node=2)[:, 1].std(), 0.0, atol=1e-5)
    root = Player(tmp_path / "a.glb").tree["nodes"][0]
    assert root["children"] == [1, 2]


def test_one_frame_is_a_plain_mesh(kick: Predictor, tmp_path: Path) -> None:
    motion = kick.solve()
    write_motion(motion, np.array([0.5]), tmp_path / "one.glb")
    write_motion(motion, np.array([0.5]), tmp_path / "{frame}.glb")
    assert (tmp_path / "one.glb").read_bytes() == (tmp_path / "00000.glb").read_bytes()
    assert b"animations" not in (tmp_path / "one.glb").read_bytes()
    write_motion(motion, TIMES, tmp_path / "all.glb")
    still = read_geometry(tmp_path / "all.glb")  # a program without animations
    assert np.allclose(np.sort(still.points, axis=0), np.sort(y_up(motion.vertices(0.0)), axis=0), atol=1e-5)


def test_a_rigid_motion_has_no_targets(kick: Predictor, tmp_path: Path) -> None:
    motion = kick.solve()
    write_motion(motion, np.array([0.0, 1e-12, 1e-7]), tmp_path / "a.glb")  # single precision keeps them apart
    player = Player(tmp_path / "a.glb")
    assert len(player.times) == 3
    assert "targets" not in player.tree["meshes"][0]["primitives"][0]
    write_motion(motion, np.array([0.5, 0.2, 0.5]), tmp_path / "b.glb")
    assert np.allclose(Player(tmp_path / "b.glb").times, [0.2, 0.5])


def test_refused(kick: Predictor, tmp_path: Path) -> None:
    motion = kick.solve()
    cloud = kick.solve(PointCloud(kick.rest.points))
    for wrong, times, said in (
        (cloud, TIMES, "holds meshes only, got a PointCloud"),
        (motion, TIMES - 0.05, "times from 0 s on, got -0.05 s"),
        (motion, np.arange(2001) / 2000.0, "2,001 frames of 2,306 points"),
    ):
        with pytest.raises(InputError, match=said):
            write_motion(wrong, times, tmp_path / "a.glb")
    assert not list(tmp_path.iterdir())
