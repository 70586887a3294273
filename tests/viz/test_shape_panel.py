"""Loaded shapes: the moving part, the alignment, and what is sent to the page."""

import socket
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import viser

from odeform.geometry.region import Box, Sphere
from odeform.geometry.shape import FittedShape
from odeform.geometry.similarity import UPRIGHT, Similarity
from odeform.models.base import Predictor
from odeform.types import GaussianSplats, PointCloud
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.columns import Column, Columns
from odeform_viz.fitting import describe_fit, shape_from
from odeform_viz.panels.playback import PlaybackPanel
from odeform_viz.panels.region import region_like
from odeform_viz.panels.shape import ShapePanel
from odeform_viz.rendering.gizmos import RegionGizmo
from odeform_viz.rendering.scene import SceneView
from odeform_viz.session import Session
from odeform_viz.view import DisplayOptions, ViewRequest

BALL, REST, SHADOW = 22_572, 31_406, 918  # splats of the bundled scene


@pytest.fixture
def port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def server(port: int) -> Iterator[viser.ViserServer]:
    server = viser.ViserServer(port=port, verbose=False)
    yield server
    server.stop()


@pytest.fixture
def app(kick: Predictor, port: int, capfd: pytest.CaptureFixture[str]) -> Iterator[App]:
    fit = shape_from("volleyball", kick.rest)
    app = App([Column("odeform", kick, fit.geometry, fit=fit)], port=port)
    app.panel(PlaybackPanel).jump(0.0)
    yield app
    app.close()
    assert "Traceback" not in capfd.readouterr().err


def test_the_still_part_is_sent_once_for_all_columns(
    kick: Predictor, server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[tuple[str, int]] = []
    moved: list[Any] = []
    add = viser.SceneApi.add_gaussian_splats

    def counted(self: viser.SceneApi, name: str, centers: np.ndarray, *rest: Any, **options: Any) -> Any:
        made.append((name, len(centers)))
        return add(self, name, centers, *rest, **options)

    monkeypatch.setattr(viser.SceneApi, "add_gaussian_splats", counted)
    monkeypatch.setattr(viser.GaussianSplatHandle, "set_gaussians", lambda handle, *arrays: moved.append(handle))
    fit = shape_from("volleyball", kick.rest)
    columns = Columns.of([Column(name, kick, fit.geometry, fit=fit) for name in ("a", "b")])
    session, view = Session(kick.schema), SceneView(server, 0.2, lambda: None)
    request = ViewRequest(session.schema.complete({}), 0.01, "balanced", columns.all)
    for time in (0.01, 0.02):
        view.publish(session.frame(replace(request, time=time)), DisplayOptions(), None)
    assert sorted(made) == [
        ("/world/column_0/body/splats", BALL),
        ("/world/column_0/ground/shadow", SHADOW),
        ("/world/column_1/body/splats", BALL),
        ("/world/column_1/ground/shadow", SHADOW),
        ("/world/still/splats", REST),
    ]
    assert {handle.name for handle in moved} == {name for name, count in made if count == BALL}
    assert not view._stage._floor.visible
    # back to the trained body: it goes, and the floor of the viewer is there again
    columns.set_shape(None)
    back = session.frame(replace(request, columns=columns.all))
    view.publish(back, DisplayOptions(), None)
    assert not view._stage._floor.visible  # each column has its own
    view.publish(back, DisplayOptions(overlay=True), None)
    assert view._stage._background is None
    assert view._stage._floor.visible


def test_small_splats_keep_their_size_as_float16(
    kick: Predictor, server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent: list[tuple[np.ndarray, float]] = []
    add = viser.SceneApi.add_gaussian_splats

    def kept(
        self: viser.SceneApi, name: str, centers: np.ndarray, covariances: np.ndarray, *rest: Any, **o: Any
    ) -> Any:
        sent.append((covariances, o["scale"]))
        return add(self, name, centers, covariances, *rest, **o)

    monkeypatch.setattr(viser.SceneApi, "add_gaussian_splats", kept)
    count = len(kick.rest.points)
    for sigma in (1e-3, 2e-5):
        covariances = np.tile(sigma**2 * np.eye(3), (count, 1, 1))
        splats = GaussianSplats(kick.rest.points, covariances, np.ones((count, 1, 3)), np.ones(count))
        session, columns = Session(kick.schema), Columns.of([Column("splats", kick, splats)]).all
        request = ViewRequest(session.schema.complete({}), 0.0, "balanced", columns)
        SceneView(server, 0.2, lambda: None).publish(session.frame(request), DisplayOptions(), None)
        shown, scale = sent[-1]
        assert np.allclose(
            scale**2 * shown.astype(np.float16).astype(float), covariances, rtol=1e-3, atol=1e-3 * sigma**2
        )


def _fit(app: App) -> FittedShape:
    fit = app.columns.all[0].fit
    assert fit is not None
    return fit


def test_a_sphere_is_chosen_counted_and_used(app: App, port: int) -> None:
    with LoopbackClient(port) as client:
        client.set("Change the region", True)
        assert client.until(lambda: f"**{BALL:,}** of {BALL + REST:,} points inside" in client.text())
        assert _fit(app).remainder is None  # the whole scene lies at rest meanwhile
        client.set("radius (%)", 3.4)  # the ball is hollow: its top alone

        def inside() -> int:
            return int(client.text().split("** of ")[0].rsplit("**")[-1].replace(",", ""))

        assert client.until(lambda: 0 < inside() < BALL)
        smaller = inside()
        client.set("Use this part", True)
        assert client.until(lambda: _fit(app).remainder is not None)
    fit = _fit(app)
    assert isinstance(fit.region, Sphere)
    assert len(fit.geometry.points) == smaller
    assert fit.remainder is not None
    assert len(fit.remainder.points) == BALL + REST - smaller
    assert np.array_equal(fit.transform.rotation, UPRIGHT["-y"])  # as it lay meanwhile


def test_an_empty_region_leaves_the_shape_and_says_why(app: App, port: int) -> None:
    before = app.columns.all
    with LoopbackClient(port) as client:
        app.panel(ShapePanel)._use_region(Box(np.full(3, 50.0), np.ones(3)))
        assert client.until(lambda: f"the region contains 0 of the {BALL + REST:,} points" in client.text())
    assert app.columns.all is before


def test_alignment_by_hand_and_back(app: App, port: int) -> None:
    automatic = _fit(app).transform
    with LoopbackClient(port) as client:
        client.set("size (%)", 150.0)
        assert client.until(lambda: _fit(app).transform.factor == pytest.approx(1.5 * automatic.factor))
        assert app.columns.all[0].geometry.points[:, 2].min() == pytest.approx(0.0, abs=1e-5)
        client.set("up axis", "+y")
        assert client.until(lambda: np.array_equal(_fit(app).transform.rotation, UPRIGHT["+y"]))
    panel = app.panel(ShapePanel)
    panel._alignment._dragged(Similarity(1.0, UPRIGHT["-z"], np.array([0.0, 0.3, 0.0])))
    assert np.allclose(_fit(app).transform.rotation, UPRIGHT["-z"] @ UPRIGHT["+y"])
    panel._rotate(None)
    again = _fit(app).transform
    assert again.factor == automatic.factor
    assert np.array_equal(again.rotation, automatic.rotation)
    assert np.array_equal(again.shift, automatic.shift)


def test_a_region_as_it_is_dragged(server: viser.ViserServer) -> None:
    gizmo = RegionGizmo(server, lambda: None)
    assert gizmo.region is None
    box = Box(np.array([0.1, 0.2, 0.3]), np.array([0.4, 0.5, 0.6]), UPRIGHT["+x"])
    gizmo.show(box)
    again = gizmo.region
    assert isinstance(again, Box)
    assert np.allclose(again.rotation, box.rotation)
    assert gizmo._visible is not None
    gizmo._visible[1].position = (1.0, 1.0, 1.0)
    moved = gizmo.region
    assert isinstance(moved, Box)
    assert np.allclose(moved.centre, 1.0)
    gizmo.hide()
    assert gizmo.region is None


def test_a_region_of_another_kind_is_about_the_same(kick: Predictor) -> None:
    fit = shape_from("volleyball", kick.rest)
    box = region_like(fit.region, "box", fit)
    assert isinstance(box, Box)
    sphere = region_like(box, "sphere", fit)
    assert isinstance(sphere, Sphere)
    assert isinstance(fit.region, Sphere)
    assert sphere.radius == pytest.approx(fit.region.radius)
    assert region_like(box, "box", fit) is box


def test_too_many_points_are_refused_or_thinned_out_with_a_word(
    kick: Predictor, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("odeform_viz.fitting.MOST_POINTS", 45_000)
    fit = shape_from("volleyball", kick.rest)
    assert len(fit.source.points) == 45_000
    assert "the 45,000 most visible of 53,978 splats" in describe_fit(fit, "volleyball", None)
    cloud = PointCloud(np.random.default_rng(0).normal(size=(45_001, 3)))
    monkeypatch.setattr("odeform_viz.fitting.read_shape", lambda _: (cloud, None))
    with pytest.raises(ValueError, match="45,001 points; expected at most 45,000"):
        shape_from("cloud.ply", kick.rest)
