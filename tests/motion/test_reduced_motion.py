"""What the motions of every model have in common, on really trained checkpoints."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from odeform.errors import InputError
from odeform.geometry.normals import vertex_normals
from odeform.geometry.rigid import rotation_z
from odeform.geometry.shape import surface_weights
from odeform.models.base import Predictor
from odeform.models.continuation import without_continuation
from odeform.models.latent.model import LatentModel
from odeform.models.registry import load, load_model
from odeform.motion.basis import DisplacementBasis
from odeform.motion.local_frames import BOUND
from odeform.motion.reduced_motion import ReducedMotion
from odeform.solver.integrate import SolverSettings
from odeform.types import GaussianSplats, Mesh, PointCloud

MODELS = ("odeform", "pod-rbf", "nearest")
SETTING = {"mass": 0.6, "force": 110.0, "azimuth": 0.7}
GRIDS = {
    "window": np.arange(121) / 120.0,
    "backwards": np.arange(121)[::-1] / 120.0,
    "shuffled": np.random.default_rng(0).permutation(121) / 120.0,
    "few": np.array([0.75, 0.25]),
    "repeated": np.array([0.5, 0.1, 0.5, 0.0, 0.5]),
}
ROUNDING = 1e-6  # m; frames come from one product over all times, which rounds by their number

everywhere = pytest.mark.parametrize("model", MODELS)


def ball(level: int) -> Mesh:
    sphere = trimesh.creation.icosphere(level, 0.1)
    return Mesh(np.add(sphere.vertices, (0.0, 0.0, 0.1)), np.asarray(sphere.faces))


def egg() -> Mesh:
    """Not round, so that turning it matters."""
    return Mesh((ball(3).points * [1.2, 0.8, 1.0]), ball(3).faces)


def speckled(points: np.ndarray) -> GaussianSplats:
    """Splats of some millimetres at `points`, each of another shape."""
    halves = 2e-3 * np.random.default_rng(5).normal(size=(len(points), 3, 3))
    colors = np.ones((len(points), 1, 3))
    return GaussianSplats(points, halves @ halves.swapaxes(1, 2), colors, np.ones(len(points)))


@everywhere
def test_starts_at_the_shape_itself(predictors: dict[str, Predictor], model: str) -> None:
    for shape in (predictors[model].rest, egg()):
        motion = predictors[model].solve(shape, SETTING)
        start = np.asarray(shape.points, dtype=np.float32)
        assert np.array_equal(motion.vertices(0.0), start)
        assert np.array_equal(motion.vertices(GRIDS["window"])[0], start)
        assert np.abs(motion.vertices(1.0) - start).max() > 0.1
        assert np.allclose(motion.pose(0.0), np.eye(4), rtol=0.0, atol=1e-15)
        assert not motion.local(0.0).any()


@everywhere
def test_vertices_are_the_pose_of_the_deformed_shape(predictors: dict[str, Predictor], model: str) -> None:
    motion = predictors[model].solve(egg(), SETTING)
    times = GRIDS["window"]
    pose, deformed = motion.pose(times), egg().points + motion.local(times)
    moved = deformed @ pose[:, :3, :3].swapaxes(1, 2) + pose[:, None, :3, 3]
    assert np.abs(motion.local(times)).max() > 1e-4
    assert np.abs(moved - motion.vertices(times)).max() < 1e-6
    one = motion.deformed(0.4) @ motion.pose(0.4)[:3, :3].T + motion.pose(0.4)[:3, 3]
    assert np.abs(one - motion.vertices(0.4)).max() < 1e-6


@everywhere
def test_a_time_has_one_answer(predictors: dict[str, Predictor], model: str) -> None:
    """Whatever was asked before, alongside or beyond, and in whatever order."""
    predictor, times = predictors[model], GRIDS["window"]
    motion = predictor.solve(None, SETTING)
    frames = motion.vertices(times)
    assert np.array_equal(motion.vertices(times), frames)
    motion.vertices(3.0)
    assert np.array_equal(motion.vertices(times), frames)
    late = predictor.solve(None, SETTING, until=2.0)
    assert np.array_equal(late.vertices(times), frames)
    early = predictor.solve(None, SETTING, until=0.1)
    early.vertices(0.05)
    assert np.array_equal(early.vertices(times), frames)
    assert np.array_equal(early.vertices(3.0), motion.vertices(3.0))
    for grid in GRIDS.values():
        rows = np.round(grid * 120.0).astype(int)
        assert np.abs(motion.vertices(grid) - frames[rows]).max() < ROUNDING
    singles = [motion.vertices(float(time)) for time in reversed(times)]
    assert np.abs(np.stack(singles[::-1]) - frames).max() < ROUNDING
    assert all(np.array_equal(motion.vertices(float(t)), s) for t, s in zip(times, singles[::-1], strict=True))


@everywhere
def test_points_in_another_order_move_alike(predictors: dict[str, Predictor], model: str) -> None:
    shape = egg()
    order = np.random.default_rng(0).permutation(len(shape.points))
    other = Mesh(shape.points[order], np.argsort(order)[shape.faces])
    one, two = (predictors[model].solve(s, SETTING).vertices(GRIDS["few"]) for s in (shape, other))
    assert np.abs(two - one[:, order]).max() < ROUNDING


@everywhere
def test_resolution_does_not_matter(predictors: dict[str, Predictor], model: str) -> None:
    coarse, fine = (predictors[model].solve(ball(level), SETTING) for level in (3, 4))
    times = GRIDS["window"]
    assert np.abs(coarse.pose(times) - fine.pose(times)).max() < 1e-4
    # the vertices of the coarser one are among those of the finer one
    shared = [int(np.linalg.norm(ball(4).points - p, axis=1).argmin()) for p in ball(3).points[::20]]
    assert np.abs(coarse.vertices(times)[:, ::20] - fine.vertices(times)[:, shared]).max() < 1e-4


@everywhere
def test_shape_and_heading_turn_the_motion(predictors: dict[str, Predictor], model: str) -> None:
    turn = rotation_z(1.1)
    turned = Mesh(egg().points @ turn.T, egg().faces)
    one = predictors[model].solve(egg(), {**SETTING, "azimuth": -0.4}).vertices(GRIDS["window"])
    two = predictors[model].solve(turned, {**SETTING, "azimuth": 0.7}).vertices(GRIDS["window"])
    assert np.abs(one @ turn.T - two).max() < ROUNDING
    unturned = predictors[model].solve(egg(), {**SETTING, "azimuth": 0.7}).vertices(GRIDS["window"])
    assert np.abs(unturned - two).max() > 1e-3


def shape_sensitive(predictors: dict[str, Predictor]) -> LatentModel:
    """As if several shapes had been trained on: the scene has one, and its model therefore ignores shape."""
    checkpoint = predictors["odeform"].checkpoint
    gains = {name: np.ones_like(array) for name, array in checkpoint.arrays.items() if name.endswith("pooled_gain")}
    assert len(gains) == 2
    return LatentModel(replace(checkpoint, arrays={**checkpoint.arrays, **gains}))


def test_each_shape_keeps_its_own_motion(predictors: dict[str, Predictor]) -> None:
    predictor, shapes = shape_sensitive(predictors), (ball(3), egg(), ball(2))
    alone = [shape_sensitive(predictors).solve(shape, SETTING).pose(0.5) for shape in shapes]
    assert np.abs(alone[0] - alone[1]).max() > 1e-5
    for _ in range(2):
        for shape, expected in zip(shapes, alone, strict=True):
            assert np.array_equal(predictor.solve(shape, SETTING).pose(0.5), expected)


def test_shape_and_heading_turn_the_motion_where_shape_matters(predictors: dict[str, Predictor]) -> None:
    predictor, turn = shape_sensitive(predictors), rotation_z(1.1)
    turned = Mesh(egg().points @ turn.T, egg().faces)
    one = predictor.solve(egg(), {**SETTING, "azimuth": -0.4}).vertices(GRIDS["window"])
    two = predictor.solve(turned, {**SETTING, "azimuth": 0.7}).vertices(GRIDS["window"])
    assert np.abs(one @ turn.T - two).max() < ROUNDING


@everywhere
def test_all_kinds_of_shapes_move_alike(predictors: dict[str, Predictor], model: str) -> None:
    points, count = ball(2).points, len(ball(2).points)
    covariances = np.tile(np.diag([1e-4, 4e-4, 9e-4]), (count, 1, 1))
    splats = GaussianSplats(points, covariances, np.ones((count, 1, 3)), np.ones(count))
    times = GRIDS["few"]
    mesh = predictors[model].solve(ball(2), SETTING).vertices(times)
    cloud = predictors[model].solve(PointCloud(points), SETTING).vertices(times)
    motion = predictors[model].solve(splats, SETTING)
    # bare points count equally, those of a mesh by their area: a little different on the same ball
    assert np.abs(cloud - mesh).max() < 1e-3
    assert np.abs(motion.vertices(times) - cloud).max() < ROUNDING
    moved, gradients = motion.covariances(0.5), motion.gradients(0.5).astype(float)
    assert np.allclose(moved, gradients @ covariances @ gradients.swapaxes(1, 2), rtol=0.0, atol=1e-9)
    assert np.allclose(motion.covariances(0.0), covariances, rtol=1e-7, atol=1e-15)
    turn = motion.pose(0.5)[:3, :3]
    assert np.allclose(turn @ motion.deformed_covariances(0.5) @ turn.T, moved, rtol=0.0, atol=1e-9)


@everywhere
def test_bound_and_size_of_the_deformation(predictors: dict[str, Predictor], model: str) -> None:
    motion = predictors[model].solve(egg(), SETTING)
    times = GRIDS["window"]
    size = np.linalg.norm(motion.local(times), axis=-1)
    bounds = np.array([motion.deformation_bound(float(time)) for time in times])
    assert (size.max(axis=1) <= bounds * (1.0 + 1e-5) + 1e-9).all()
    assert np.allclose(motion.deformation_rms(times), np.sqrt(size**2 @ surface_weights(egg())), rtol=1e-3, atol=1e-8)


@everywhere
def test_shapes_without_sense(predictors: dict[str, Predictor], model: str) -> None:
    for points in (np.zeros((0, 3)), np.array([[0.0, 0.0, np.nan], [1.0, 0.0, 0.0]])):
        with pytest.raises(InputError):
            predictors[model].solve(PointCloud(points))


@everywhere
@pytest.mark.parametrize(
    "setting", [{"speed": 1.0}, {"mass": "heavy"}, {"mass": np.nan}, {"mass": -1.0}, {"force": np.inf}], ids=str
)
def test_parameters_without_sense(predictors: dict[str, Predictor], model: str, setting: dict) -> None:
    with pytest.raises(InputError, match=next(iter(setting))):
        predictors[model].solve(None, setting)


@everywhere
def test_outside_and_beyond_are_told(predictors: dict[str, Predictor], model: str) -> None:
    motion = predictors[model].solve(None, {"mass": 2.0, "azimuth": 9.0})
    assert motion.outside == ("mass",)
    assert not motion.extrapolates(1.0)
    assert motion.extrapolates(1.01)
    assert motion.stats.status == "ok"
    assert np.isfinite(motion.vertices(GRIDS["window"])).all()


@everywhere
def test_nothing_that_is_asked_makes_a_motion_explode(predictors: dict[str, Predictor], model: str) -> None:
    predictor, times = predictors[model], np.array([0.5, 1.0, 2.0, 1e4])
    trained = np.abs(predictor.solve(None, SETTING).vertices(GRIDS["window"])).max()
    for mass, force in itertools.product((1e-300, 1e300), (-1e308, 0.0, 1e308)):
        frames = predictor.solve(None, {"mass": mass, "force": force}, until=1e4).vertices(times)
        assert np.abs(frames).max() < 10.0 * trained
    far = PointCloud(np.array([[1e6, 0.0, 0.0], [-1e-6, 0.0, 1e6]]))
    assert np.abs(predictor.solve(far).local(GRIDS["window"])).max() < 1.0


def test_unknown_quality(predictors: dict[str, Predictor]) -> None:
    with pytest.raises(InputError, match="balanced"):
        predictors["odeform"].solve(None, quality="perfect")


def test_baselines_without_a_continuation_hold_their_last_frame(predictors: dict[str, Predictor]) -> None:
    for model in ("pod-rbf", "nearest"):
        alone = without_continuation(predictors[model].checkpoint)
        motion = load_model(alone).solve(None, SETTING)
        assert np.array_equal(motion.vertices(7.0), motion.vertices(1.0))


@pytest.mark.parametrize(
    "quality",
    [
        SolverSettings("euler", step=1.0 / 120.0),
        SolverSettings("midpoint", step=1.0 / 120.0),
        SolverSettings("rk4", step=1.0 / 60.0),
        SolverSettings("rk4", step=1.0 / 120.0),
        SolverSettings("dopri5", tolerance=1e-3),
        SolverSettings("dopri5", tolerance=1e-5),
    ],
    ids=str,
)
def test_solver_error_is_of_the_size_it_says(predictors: dict[str, Predictor], quality: SolverSettings) -> None:
    """In double precision: single rounds by more than what the better settings leave."""
    predictor = predictors["odeform"]

    def solve(setting: SolverSettings) -> ReducedMotion:
        return predictor.solve(None, SETTING, replace(setting, dtype="float64"), 1.0)

    def frames(setting: SolverSettings) -> tuple[np.ndarray, np.ndarray]:
        y = solve(setting).trajectory.reduced(times)
        return y[:, :6], y[:, 6:]

    times = np.linspace(0.0, 1.0, 66)[1:]
    (pose, local), (true_pose, true_local) = frames(quality), frames(SolverSettings("dopri5", tolerance=1e-10))
    gyration_radius = predictor.space.gyration_radius  # pyright: ignore[reportAttributeAccessIssue]
    # the vertices are single precision: compare what moves them instead, in RMS over coordinates, points and times
    squared = ((pose - true_pose)[:, :3] ** 2).sum(axis=1) + ((local - true_local) ** 2).sum(axis=1)
    squared += 2.0 / 3.0 * gyration_radius**2 * ((pose - true_pose)[:, 3:] ** 2).sum(axis=1)
    error = 1e3 * np.sqrt(squared.mean() / 3.0)
    said = solve(quality).stats.solver_error_mm
    assert said is not None
    assert 0.8 * error < said < 1.25 * error  # other times are looked at


def test_half_the_step_moves_by_no_more_than_the_error_said(predictors: dict[str, Predictor]) -> None:
    predictor = predictors["odeform"]
    for name in ("euler", "midpoint"):
        motion = predictor.solve(None, SETTING, SolverSettings(name, step=1.0 / 120.0))
        half = predictor.solve(None, SETTING, SolverSettings(name, step=0.5 / 120.0))
        moved = np.linalg.norm(motion.vertices(GRIDS["window"]) - half.vertices(GRIDS["window"]), axis=-1)
        assert motion.stats.solver_error_mm is not None
        assert 1e3 * np.sqrt((moved**2).mean() / 3.0) < 1.05 * motion.stats.solver_error_mm


def test_gradients_match_finite_differences(predictors) -> None:
    """Along the surface; across it the unit normal goes to the unit normal."""
    predictor, time, step = predictors["odeform"], 0.02, 1e-3
    heading = {"azimuth": 0.7}
    motion = predictor.solve(parameters=heading)
    gradients = motion.gradients(time).astype(float)
    slopes = np.empty_like(gradients)
    for axis in range(3):
        shift = step * np.eye(3)[axis]
        ends = [
            predictor.solve(replace(predictor.rest, points=predictor.rest.points + sign * shift), heading)
            for sign in (1.0, -1.0)
        ]
        slopes[:, :, axis] = (ends[0].vertices(time).astype(float) - ends[1].vertices(time)) / (2.0 * step)
    normals = vertex_normals(predictor.rest.points.astype(float), predictor.rest.faces)
    tangential = np.eye(3) - normals[:, :, None] * normals[:, None, :]
    assert np.abs(slopes @ tangential - np.eye(3) @ tangential).max() > 0.02
    np.testing.assert_allclose(gradients @ tangential, slopes @ tangential, atol=2e-3)
    deformed = (gradients @ normals[..., None])[..., 0]
    np.testing.assert_allclose(np.linalg.norm(deformed, axis=1), 1.0, atol=1e-5)
    np.testing.assert_allclose(np.einsum("ni,nij->nj", deformed, slopes @ tangential), 0.0, atol=2e-3)


@everywhere
def test_splats_and_heading_turn_together(predictors: dict[str, Predictor], model: str) -> None:
    turn, time = rotation_z(1.1), 0.02
    splats = speckled(egg().points)
    turned = replace(splats, points=splats.points @ turn.T, covariances=turn @ splats.covariances @ turn.T)
    one = predictors[model].solve(splats, {**SETTING, "azimuth": -0.4})
    two = predictors[model].solve(turned, {**SETTING, "azimuth": 0.7})
    expected = turn @ one.covariances(time) @ turn.T
    assert np.abs(two.covariances(time) - expected).max() < 1e-4 * np.abs(expected).max()
    turns = np.einsum("nji,njk->nik", one.rotations(time), one.rotations(time))
    assert np.abs(turns - np.eye(3)).max() < 1e-5
    assert np.abs(two.rotations(time) - turn @ one.rotations(time) @ turn.T).max() < 1e-4


def test_a_change_of_parameters_evaluates_no_slope_again(
    predictors: dict[str, Predictor], monkeypatch: pytest.MonkeyPatch
) -> None:
    counted = []
    slopes = DisplacementBasis.slopes
    monkeypatch.setattr(DisplacementBasis, "slopes", lambda *a: (counted.append(1), slopes(*a))[1])
    splats = speckled(egg().points)
    predictors["odeform"].solve(splats, SETTING).vertices(0.1)
    assert not counted
    for mass in (0.4, 0.5, 0.6):
        predictors["odeform"].solve(splats, {**SETTING, "mass": mass}).covariances(0.1)
    assert len(counted) == 1
    predictors["odeform"].solve(splats, {**SETTING, "azimuth": 0.1}).covariances(0.1)
    assert len(counted) == 2


def test_bundled_models_stay_far_within_the_bound() -> None:
    for scene in ("kick", "mass-elastic"):
        predictor, rng = load(scene), np.random.default_rng(0)
        for _ in range(5):
            setting = {p.name: p.denormalise(rng.uniform(-1.0, 1.0)) for p in predictor.schema.learned}
            motion = predictor.solve(None, setting)
            for time in rng.uniform(0.0, predictor.schema.window.stop, 10):
                stretch = np.linalg.svd(motion.gradients(float(time)), compute_uv=False)
                assert 0.5 * BOUND > stretch.max() >= stretch.min() > 2.0 / BOUND
