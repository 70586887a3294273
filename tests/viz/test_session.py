"""What is computed, and what is not."""

from dataclasses import replace

import numpy as np
import pytest

from odeform import InputError
from odeform.predictor import Predictor
from odeform.types import GaussianSplats
from odeform_viz.panels.status import describe, moment_in_words
from odeform_viz.session import Column, Session, Wish


@pytest.fixture
def session(predictors: dict[str, Predictor]) -> Session:
    return Session([Column(name, p, p.rest) for name, p in predictors.items()])


@pytest.fixture
def wish(session: Session) -> Wish:
    return Wish(session.schema.complete({}), 0.02, "balanced", (True, True, True))


def test_time_alone_never_integrates_again(session: Session, wish: Wish) -> None:
    first = session.frame(wish).columns[0]
    later = session.frame(replace(wish, time=0.4)).columns[0]
    assert first is not None
    assert later is not None
    assert later.motion is first.motion
    changed = session.frame(replace(wish, parameters={**wish.parameters, "mass": 0.7})).columns[0]
    assert changed is not None
    assert changed.motion is not first.motion


def test_hidden_columns_are_not_computed(session: Session, wish: Wish, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    for column in session.columns:
        solve = column.predictor.solve
        monkeypatch.setattr(
            column.predictor, "solve", lambda *a, _s=solve, _c=column.label, **k: (asked.append(_c), _s(*a, **k))[1]
        )
    frame = session.frame(replace(wish, visible=(False, True, False)))
    assert asked == [session.columns[1].label]
    assert [column is None for column in frame.columns] == [True, False, True]


def test_a_frame_is_what_the_predictor_says(kick: Predictor) -> None:
    session = Session([Column("odeform", kick, kick.rest)])
    shown = session.frame(Wish(session.schema.complete({}), 0.02, "balanced", (True,))).columns[0]
    assert shown is not None
    assert shown.points is not None
    motion = kick.solve(kick.rest)
    np.testing.assert_array_equal(shown.points, motion.deformed(0.02))
    moved = shown.points @ shown.pose[:3, :3].T + shown.pose[:3, 3]
    np.testing.assert_allclose(moved, motion.vertices(0.02), atol=1e-6)


def test_at_rest_a_pose_says_it_all(session: Session, wish: Wish) -> None:
    shown = session.frame(replace(wish, time=0.0)).columns[0]
    assert shown is not None
    assert shown.points is None
    np.testing.assert_allclose(shown.pose, np.eye(4), atol=1e-12)


def test_splats_deform_with_the_body(kick: Predictor) -> None:
    halves = 2e-3 * np.random.default_rng(0).normal(size=(len(kick.rest.points), 3, 3))
    ones = np.ones((len(halves), 3))
    splats = GaussianSplats(kick.rest.points, halves @ halves.swapaxes(1, 2), ones, ones[:, 0])
    session = Session([Column("splats", kick, splats), Column("mesh", kick, kick.rest)])
    wish = Wish(session.schema.complete({}), 0.02, "balanced", (True, True))
    shown, mesh = session.frame(wish).columns
    assert shown is not None
    assert shown.covariances is not None
    assert mesh is not None
    assert mesh.covariances is None
    turn = shown.pose[:3, :3]
    moved = kick.solve(splats).covariances(0.02)
    np.testing.assert_allclose(turn @ shown.covariances @ turn.T, moved, atol=1e-5 * moved.max())
    assert np.abs(shown.covariances - splats.covariances).max() > 1e-3 * splats.covariances.max()
    resting = session.frame(replace(wish, time=0.0)).columns[0]
    assert resting is not None
    assert resting.covariances is None


@pytest.mark.parametrize("time", [float("nan"), float("inf"), -1.0])
def test_impossible_times_are_refused(session: Session, wish: Wish, time: float) -> None:
    with pytest.raises(InputError, match="time"):
        session.frame(replace(wish, time=time))


def test_another_scene_is_refused(session: Session) -> None:
    first, other = session.columns[:2]

    class Foreign:
        schema = replace(other.predictor.schema, scene="mass-elastic")

    with pytest.raises(InputError, match="mass-elastic"):
        Session([first, Column("foreign", Foreign(), other.geometry)])  # pyright: ignore[reportArgumentType]


def test_the_moment_in_words(session: Session, wish: Wish) -> None:
    assert "inside" in moment_in_words(session.frame(wish))
    late = moment_in_words(session.frame(replace(wish, time=1.3)))
    assert "extrapolated" in late
    assert "time" in late
    heavy = moment_in_words(session.frame(replace(wish, parameters={**wish.parameters, "mass": 1.1})))
    assert "mass" in heavy


def test_status_names_solver_error_as_such(session: Session, wish: Wish) -> None:
    shown = session.frame(wish).columns[0]
    assert shown is not None
    text = describe(session.columns[0], shown)
    assert "solver error" in text
    assert "test error of the checkpoint" in text
    assert f"{shown.stats.evaluations} evaluations" in text


def test_largest_deformation_is_at_the_kick(kick: Predictor) -> None:
    session = Session([Column("odeform", kick, kick.rest)])
    moment = session.largest_deformation(Wish(session.schema.complete({}), 0.0, "balanced", (True,)))
    assert 0.005 < moment < 0.03
