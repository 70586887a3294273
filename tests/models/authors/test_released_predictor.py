from pathlib import Path

import numpy as np
import pytest
from authors import Authors

import odeform
from odeform.errors import InputError
from odeform.geometry.primitives import octasphere
from odeform.models.authors import layers
from odeform.models.base import Predictor
from odeform.types import GaussianSplats, Mesh, PointCloud

KINDS = [("mlp", 1), ("pemlp", 1), ("pointnet", 3), ("pointnet_bn", 3), ("mlp", 3), ("pointnet_bn", 1)]
BAR = 1e-5  # m
ROUNDING = 1e-6  # m; products of many rows round otherwise than that of one


def body() -> Mesh:
    ball = octasphere(0.08, 3)
    return Mesh((ball.points * [1.0, 0.7, 1.2] + [0.01, -0.02, 0.03]).astype(np.float32), ball.faces)


def setting(offsets: int) -> tuple[dict[str, object], list[float], list[float]]:
    """Parameters, as the network sees them, and the first offset in metres."""
    if offsets == 1:
        return {"mass": 0.6, "bending": "2.1", "initial_offset": 0.4}, [2 * (0.2 - 0.5), 2 * (0.7 - 0.5)], [0.4]
    contact, force, offset = [0.3, -0.2, 0.5], [0.1, 0.9, -0.4], [0.05, -0.03, 0.02]
    given = {"contact": "0.3,-0.2,0.5", "force": np.array(force), "initial_offset": tuple(offset)}
    return given, contact + force, offset


@pytest.mark.parametrize(("kind", "offsets"), KINDS)
def test_agrees_with_the_reference_on_its_frames(
    kind: str, offsets: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(layers, "CHUNK", 10)  # the body in several pieces
    authors = Authors(kind, offsets)
    predictor = odeform.load(authors.save(tmp_path / "a.pth"))
    assert isinstance(predictor, Predictor)
    given, theta, offset = setting(offsets)
    motion, rest = predictor.solve(body(), given), body()
    assert motion.stats.status == "ok"
    assert "3/8" in motion.stats.solver
    times = np.round(predictor.schema.window.times, 2)
    wanted = authors.world(rest.points.astype(float), theta, offset, times)
    assert np.abs(wanted - wanted[0]).max() > 100 * BAR
    vertices = motion.vertices(times)
    assert np.abs(vertices - wanted).max() < BAR
    # the parts make the whole
    pose, local = motion.pose(times), motion.local(times)
    assert np.allclose(rest.points + local + pose[:, None, :3, 3], vertices, atol=1e-6)
    assert np.allclose(motion.deformation_rms(times[3:4]), np.linalg.norm(local[3], axis=1).mean(), rtol=0.2)


@pytest.fixture
def drop(tmp_path: Path) -> Predictor:
    return odeform.load(Authors("pemlp", 1).save(tmp_path / "a.pth"))


def test_cubic_between_frames_whatever_is_asked(drop: Predictor) -> None:
    motion = drop.solve()
    at = np.array([2.41, 2.0, 2.333])
    assert np.abs(motion.vertices(at)[0] - motion.vertices(2.41)).max() < ROUNDING
    frames = motion.vertices(drop.schema.window.times)
    one, two = frames[8], frames[9]
    between = motion.vertices(2.425)
    assert np.abs(between - 0.5 * (one + two)).max() < 0.3 * np.abs(two - one).max()
    assert np.abs(motion.vertices(9.0) - frames[-1]).max() < ROUNDING
    assert np.abs(motion.vertices(0.0) - frames[0]).max() < ROUNDING
    assert np.array_equal(drop.solve(quality="reference", until=2.1).vertices(2.7), motion.vertices(2.7))


def test_without_a_geometry_a_ball_is_used(drop: Predictor) -> None:
    assert np.allclose(np.linalg.norm(drop.rest.points, axis=1), 0.1)
    assert np.array_equal(drop.solve().vertices(2.5), drop.solve(drop.rest).vertices(2.5))
    assert any("is used unless a geometry is given" in note for note in drop.schema.notes)


def test_size_and_place_are_taken_as_they_are(drop: Predictor) -> None:
    rest = body()
    twice = Mesh(2.0 * rest.points, rest.faces)
    one, two = drop.solve(rest), drop.solve(twice)
    assert np.allclose(2.0 * (rest.points + one.local(2.5)), twice.points + two.local(2.5), atol=1e-5)
    assert np.allclose(one.pose(2.5), two.pose(2.5))
    raised = Mesh(rest.points + np.array([0.0, 0.0, 0.4]), rest.faces)
    seated = drop.to_body_frame(raised, {"initial_offset": 0.4})
    assert np.allclose(seated.points, rest.points, atol=1e-7)
    assert drop.to_body_frame(raised, {"initial_offset": 0.4}) is seated


def test_points_move_and_splats_are_refused(drop: Predictor) -> None:
    rest = body()
    cloud = drop.solve(PointCloud(rest.points))
    assert np.array_equal(cloud.vertices(2.2), drop.solve(rest).vertices(2.2))
    with pytest.raises(InputError, match="splats"):
        cloud.covariances(2.2)
    count = len(rest.points)
    splats = GaussianSplats(rest.points, np.zeros((count, 3, 3)), np.zeros((count, 1, 3)), np.ones(count))
    with pytest.raises(InputError, match="splats"):
        drop.solve(splats)


@pytest.mark.parametrize("value", ["0.1,0.2", "a,b,c", 3.0, [1.0, 2.0, float("nan")]])
def test_vectors_have_three_numbers(tmp_path: Path, value: object) -> None:
    predictor = odeform.load(Authors("mlp", 3).save(tmp_path / "a.pth"))
    with pytest.raises(InputError, match="contact"):
        predictor.solve(None, {"contact": value})
