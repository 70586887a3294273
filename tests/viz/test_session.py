"""What is computed, and what is not."""

import re
from dataclasses import replace

import numpy as np
import pytest
from stubs import PEAK, StubPredictor

import odeform
from odeform import InputError
from odeform.dataset.index import Dataset
from odeform.geometry.shape import fit_to
from odeform.models.base import Predictor
from odeform.motion.recorded import RecordedMotion
from odeform.motion.truth_errors import DISTANCE
from odeform.types import GaussianSplats
from odeform_viz.columns import Column, Columns
from odeform_viz.panels.status import describe_column, status_html
from odeform_viz.panels.summary import badge_of, summarize
from odeform_viz.session import Session, visible_deformation
from odeform_viz.view import INVISIBLE, Error, ViewRequest
from odeform_viz.words import rounded


@pytest.fixture
def columns(predictors: dict[str, Predictor]) -> tuple[Column, ...]:
    return Columns.of([Column(name, p, p.rest) for name, p in predictors.items()]).all


@pytest.fixture
def session(columns: tuple[Column, ...]) -> Session:
    return Session(columns[0].source.schema)


@pytest.fixture
def view_request(session: Session, columns: tuple[Column, ...]) -> ViewRequest:
    return ViewRequest(session.schema.complete({}), 0.02, "balanced", columns)


def _alone(predictor: Predictor, time: float = 0.02) -> tuple[Session, ViewRequest]:
    session = Session(predictor.schema)
    columns = Columns.of([Column(predictor.model, predictor, predictor.rest)]).all
    return session, ViewRequest(session.schema.complete({}), time, "balanced", columns)


def test_time_alone_never_integrates_again(session: Session, view_request: ViewRequest) -> None:
    first = session.frame(view_request).columns[0]
    later = session.frame(replace(view_request, time=0.4)).columns[0]
    assert later.motion is first.motion
    changed = session.frame(replace(view_request, parameters={**view_request.parameters, "mass": 0.71})).columns[0]
    assert changed.motion is not first.motion


def test_hidden_columns_are_not_computed(
    session: Session, view_request: ViewRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []
    for column in view_request.columns:
        solve = column.source.solve
        monkeypatch.setattr(
            column.source, "solve", lambda *a, _s=solve, _c=column.label, **k: (asked.append(_c), _s(*a, **k))[1]
        )
    shown = tuple(replace(column, visible=index == 1) for index, column in enumerate(view_request.columns))
    frame = session.frame(replace(view_request, columns=shown))
    assert asked == [view_request.columns[1].label]
    assert [column.column.label for column in frame.columns] == asked


def test_a_frame_is_what_the_predictor_says(kick: Predictor) -> None:
    session, view_request = _alone(kick)
    shown = session.frame(view_request).columns[0]
    assert shown.points is not None
    motion = kick.solve(kick.rest)
    np.testing.assert_array_equal(shown.points, motion.deformed(0.02))
    moved = shown.points @ shown.pose[:3, :3].T + shown.pose[:3, 3]
    np.testing.assert_allclose(moved, motion.vertices(0.02), atol=1e-6)


def test_a_pinned_column_does_not_heed_the_sliders(session: Session, view_request: ViewRequest) -> None:
    first = view_request.columns[0]
    pinned = replace(first, key=99, pinned={**view_request.parameters, "mass": 0.9})
    heavy = replace(view_request, parameters={**view_request.parameters, "mass": 0.6}, columns=(first, pinned))
    under, apart = session.frame(heavy).columns
    assert under.motion.parameters["mass"] == 0.6
    assert apart.motion.parameters["mass"] == 0.9
    later = session.frame(replace(heavy, parameters=view_request.parameters)).columns[1]
    assert later.motion is apart.motion


@pytest.fixture
def truth(dataset: Dataset, session: Session) -> Column:
    motion = RecordedMotion(session.schema, next(dataset.sequences("test")))
    return Column("truth", motion, motion.geometry, key=50)


def test_the_error_is_that_against_the_truth_at_its_vertices(
    session: Session, view_request: ViewRequest, truth: Column
) -> None:
    record = truth.truth
    assert record is not None
    time = float(record.sequence.times[12])
    at = replace(view_request, parameters=record.parameters, time=time, columns=(*view_request.columns, truth))
    shown = session.frame(at).columns[0]
    assert shown.error is not None
    predicted = view_request.columns[0].source.solve(record.geometry, record.parameters).vertices(time)
    off = predicted.astype(float) - record.sequence.vertices[12]
    assert shown.error.rmse_mm == pytest.approx(1e3 * np.sqrt((off**2).mean()), rel=1e-5)
    assert shown.error.rms_mm == pytest.approx(1e3 * np.sqrt((off**2).sum(axis=1).mean()), rel=1e-5)
    assert shown.error.worst_mm == pytest.approx(1e3 * np.linalg.norm(off, axis=1).max(), rel=1e-5)
    curve = session.curves(shown, at).error
    assert curve is not None
    assert curve[round(time * session.schema.window.rate)] == pytest.approx(shown.error.rms_mm, rel=1e-4)


def test_without_its_parameters_the_truth_tells_no_error(
    session: Session, view_request: ViewRequest, truth: Column, kick: Predictor
) -> None:
    record = truth.truth
    assert record is not None
    moved = {**record.parameters, "mass": record.parameters["mass"] * 1.05}
    columns = (*view_request.columns, truth)
    assert all(s.error is None for s in session.frame(replace(view_request, parameters=moved, columns=columns)).columns)
    foreign = tuple(replace(column, fit=fit_to(column.geometry, kick.rest)) for column in view_request.columns)
    at = replace(view_request, parameters=record.parameters, columns=(*foreign, truth))
    assert all(shown.error is None for shown in session.frame(at).columns)


def test_at_rest_a_pose_says_it_all(session: Session, view_request: ViewRequest) -> None:
    shown = session.frame(replace(view_request, time=0.0)).columns[0]
    assert shown.points is None
    np.testing.assert_allclose(shown.pose, np.eye(4), atol=1e-12)


@pytest.mark.parametrize(("size", "seen"), [(0.9, False), (1.1, True)])
def test_a_deformation_too_small_to_see_is_left_out(kick: Predictor, size: float, seen: bool) -> None:
    """Also where its modes, each at its largest, would add up to more."""
    motion = kick.solve(None, None)
    largest = float(np.linalg.norm(motion.local(0.02), axis=1).max())
    rows = motion.evaluated.rows * np.float32(size * INVISIBLE / largest)
    reach = motion.evaluated.reach * (2.0 * INVISIBLE / motion.deformation_bound(0.02))
    small = replace(motion, evaluated=replace(motion.evaluated, rows=rows, reach=reach))
    assert small.deformation_bound(0.02) > INVISIBLE
    assert (visible_deformation(small, 0.02) is not None) == seen


def test_splats_deform_with_the_body(kick: Predictor) -> None:
    halves = 2e-3 * np.random.default_rng(0).normal(size=(len(kick.rest.points), 3, 3))
    ones = np.ones((len(halves), 3))
    splats = GaussianSplats(kick.rest.points, halves @ halves.swapaxes(1, 2), ones[:, None], ones[:, 0])
    columns = Columns.of([Column("splats", kick, splats), Column("mesh", kick, kick.rest)]).all
    session = Session(kick.schema)
    view_request = ViewRequest(session.schema.complete({}), 0.02, "balanced", columns)
    shown, mesh = session.frame(view_request).columns
    assert shown.covariances is not None
    assert mesh.covariances is None
    turn = shown.pose[:3, :3]
    moved = kick.solve(splats).covariances(0.02)
    np.testing.assert_allclose(turn @ shown.covariances @ turn.T, moved, atol=1e-5 * moved.max())
    assert np.abs(shown.covariances - splats.covariances).max() > 1e-3 * splats.covariances.max()
    assert session.frame(replace(view_request, time=0.0)).columns[0].covariances is None


@pytest.mark.parametrize("time", [float("nan"), float("inf"), -1.0])
def test_impossible_times_are_refused(session: Session, view_request: ViewRequest, time: float) -> None:
    with pytest.raises(InputError, match="time"):
        session.frame(replace(view_request, time=time))


def test_the_summary(session: Session, view_request: ViewRequest) -> None:
    inside = badge_of(session.frame(replace(view_request, time=0.02)))
    assert (inside.level, inside.text) == ("inside", "inside the trained range")
    assert badge_of(session.frame(replace(view_request, time=1.3))).level == "outside"
    late = summarize(session.frame(replace(view_request, time=1.3)))
    assert "extrapolated" in late
    assert "time" in late
    heavy = summarize(session.frame(replace(view_request, parameters={**view_request.parameters, "mass": 1.6})))
    assert "mass" in heavy


def test_an_error_above_the_expected_one_is_remarked_and_a_large_one_is_not_reliable() -> None:
    session, view_request = _alone(odeform.load("kick"))
    frame = session.frame(view_request)
    (shown,) = frame.columns
    band = shown.error_band(np.array([shown.time]))
    assert band is not None
    for share, remarked in ((0.5, False), (1.5, True)):
        of_coordinates = share * float(band[0, 1]) / DISTANCE
        error = Error(np.full(len(shown.column.geometry.points), 1e-3), of_coordinates, of_coordinates)
        text = summarize(replace(frame, columns=(replace(shown, error=error),)))
        assert "error now: " in text
        assert ("above what is expected" in text) == remarked
    huge = Error(np.full(len(shown.column.geometry.points), 1e-3), 2e3 / DISTANCE, 2e3 / DISTANCE)
    assert "error now: 2000 mm" in summarize(replace(frame, columns=(replace(shown, error=huge),)))
    late = session.frame(replace(view_request, time=2.0 * session.schema.window.stop))
    assert (badge_of(late).level, badge_of(late).text) == ("unknown", "not reliable")


def test_a_motion_that_has_ended_is_not_modelled_any_more() -> None:
    session, view_request = _alone(odeform.load("contact-force").under("throw"))
    # a cat of half its stiffness, whose law ends when it has collapsed
    turns = {"turn_x": -136.5826, "turn_y": 87.32333, "turn_z": 159.57345}
    thrown = {"height": 0.298001, "velocity_x": 0.893359, "velocity_y": 1.142126, "velocity_z": 1.39857}
    spin = {"spin_x": 4.123697, "spin_y": -3.243752, "spin_z": 7.568278}
    soft = {"object": "cat", **turns, **thrown, **spin, "mass": 1.325951, "young": 36.915316}
    parameters = {**view_request.parameters, **soft}
    before, after = (session.frame(replace(view_request, parameters=parameters, time=time)) for time in (0.4, 1.5))
    assert "gains energy" not in badge_of(before).detail
    assert badge_of(after).level == "unknown"
    assert badge_of(after).detail.startswith("it gains energy after t = 0.")
    assert "it gains energy" in describe_column(after.columns[0], 1.5)


def test_of_several_models_the_largest_error_is_expected() -> None:
    session, view_request = _alone(odeform.load("kick"))
    (model,) = view_request.columns
    columns = Columns.of([model, replace(model, pinned={**view_request.parameters, "force": 160.0})]).all
    frame = session.frame(replace(view_request, columns=columns))
    bands = [float(band[0, 1]) for c in frame.columns if (band := c.error_band(np.array([c.time]))) is not None]
    assert f"below {max(bands):.2g} mm in 9 of 10 cases, the largest of 2" in badge_of(frame).expected


def test_status_is_a_table() -> None:
    session, view_request = _alone(odeform.load("kick"))
    html = status_html([describe_column(session.frame(view_request).columns[0], view_request.time)])
    assert "<td>solver error: </td>" in html
    assert html.count("<th") == 1


def test_a_body_below_the_floor_is_remarked(session: Session, view_request: ViewRequest) -> None:
    frame = session.frame(view_request)
    sunk = replace(frame.columns[0], depth=0.012)
    assert sunk.below_floor
    assert "12 mm below the floor" in summarize(replace(frame, columns=(sunk,)))


def test_status_names_solver_error_as_such(session: Session, view_request: ViewRequest) -> None:
    shown = session.frame(view_request).columns[0]
    text = describe_column(shown, view_request.time)
    assert "solver error" in text
    assert "error on the test sequences" in text
    assert re.search(r"\d+ evaluations", text)
    assert "error expected here: not known, with fewer than 8 validation sequences" in text


def test_status_claims_no_error_of_pushes_for_another_load() -> None:
    session, view_request = _alone(odeform.load("contact-force:drop"))
    text = describe_column(session.frame(view_request).columns[0], view_request.time)
    assert "error expected here: not known for motions of this kind" in text
    assert "test sequences" not in text


@pytest.mark.parametrize(("value", "text"), [(3491.2, "3490"), (0.03852, "0.0385"), (12.0, "12")])
def test_numbers_have_no_exponent(value: float, text: str) -> None:
    assert rounded(value) == text


def test_status_says_how_far_off_the_model_is() -> None:
    session, view_request = _alone(odeform.load("kick"))
    text = describe_column(session.frame(view_request).columns[0], view_request.time)
    assert "error expected here: half below" in text
    assert "extrapolated: rough" not in text
    later = replace(view_request, time=1.2 * session.schema.window.stop)
    assert "(extrapolated: rough)" in describe_column(session.frame(later).columns[0], later.time)


def test_status_says_when_a_pushed_body_rests_and_that_no_error_is_known_at_another_mass() -> None:
    model = odeform.load("contact-force")
    session, bottle = _alone(model)
    assert "still moves at 1 s" in describe_column(session.frame(bottle).columns[0], 0.1)
    cat = model.complete({"object": "cat"})
    columns = Columns.of([Column(model.model, model, model.rest_of(cat))]).all
    view_request = replace(bottle, parameters=cat, columns=columns)
    shown = session.frame(view_request).columns[0]
    assert re.search(r"at rest from t = 0\.\d\d s on", describe_column(shown, 0.1))
    assert "error expected here: half below" in describe_column(shown, 0.1)
    assert "at rest" not in describe_column(shown, 0.1, settled=False)
    heavy = {**view_request.parameters, "mass": 1.5 * view_request.parameters["mass"]}
    text = describe_column(session.frame(replace(view_request, parameters=heavy)).columns[0], 0.1)
    assert "error expected here: not known, no data have this mass or stiffness" in text


def test_largest_deformation_is_at_the_kick(kick: Predictor) -> None:
    session, view_request = _alone(kick, 0.0)
    assert 0.005 < session.largest_deformation(view_request) < 0.03


def test_the_first_impact_is_around_the_first_large_deformation() -> None:
    stub = StubPredictor()
    session, columns = Session(stub.schema), Columns.of([Column("stub", stub, stub.rest)]).all
    request = ViewRequest(stub.schema.complete({}), 0.0, "balanced", columns)
    start, stop = session.first_impact(request)
    assert start < PEAK < stop
    assert session.first_impact(replace(request, columns=())) == (0.0, 0.0)
