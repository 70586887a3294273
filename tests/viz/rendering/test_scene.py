"""What is sent to the page for a frame."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
import viser
from pushed import PushedPredictor
from stubs import SCHEMA, StubPredictor, recorded

import odeform
from odeform.cancellation import Cancelled
from odeform.models.base import Predictor
from odeform.motion.recorded import RecordedMotion
from odeform.simulation.contacts import vector_of
from odeform.simulation.scenes.contact_force import PULSE
from odeform.types import GaussianSplats
from odeform_viz.colors import CLAY, color_of
from odeform_viz.columns import Column, Columns
from odeform_viz.rendering.framing import Box
from odeform_viz.rendering.scene import SceneView
from odeform_viz.session import Session
from odeform_viz.view import DisplayOptions, ViewRequest


def test_splats_are_sent_deformed_and_as_given_at_rest(
    server: viser.ViserServer, kick: Predictor, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent = []
    monkeypatch.setattr(viser.GaussianSplatHandle, "set_gaussians", lambda _, *arrays: sent.append(arrays))
    ones = np.ones((len(kick.rest.points), 3))
    splats = GaussianSplats(kick.rest.points, np.tile(1e-6 * np.eye(3), (len(ones), 1, 1)), ones[:, None], ones[:, 0])
    session = Session(kick.schema)
    columns = Columns.of([Column("splats", kick, splats)]).all
    request = ViewRequest(session.schema.complete({}), 0.02, "balanced", columns)
    view = SceneView(server, 0.2, lambda: None)
    for time in (0.02, 0.0):
        view.publish(session.frame(replace(request, time=time)), DisplayOptions(), None)
    moved, resting = sent
    motion = kick.solve(splats)
    # in centimetres: float16 would lose square metres
    np.testing.assert_allclose(moved[0], 100.0 * motion.deformed(0.02), rtol=1e-6)
    # except subnormals of float16
    lost = float(np.finfo(np.float16).smallest_normal)
    np.testing.assert_allclose(moved[1], 1e4 * motion.deformed_covariances(0.02), rtol=1e-6, atol=lost)
    np.testing.assert_allclose(resting[1], 1e4 * splats.covariances, rtol=1e-6, atol=lost)
    assert np.abs(moved[1] - resting[1]).max() > 1e-2 * resting[1].max()


def test_a_row_whose_framing_was_cancelled_is_framed_by_the_next_frame(
    server: viser.ViserServer, kick: Predictor, monkeypatch: pytest.MonkeyPatch
) -> None:
    session, view = Session(kick.schema), SceneView(server, 0.2, lambda: None)
    columns = Columns.of([Column("left", kick, kick.rest), Column("right", kick, kick.rest)]).all
    request = ViewRequest(session.schema.complete({}), 0.02, "balanced", columns[:1])
    view.publish(session.frame(request), DisplayOptions(), None)
    both = session.frame(replace(request, columns=columns))
    with monkeypatch.context() as patch:
        patch.setattr("odeform_viz.rendering.scene.outline_of", lambda *_: cancelled())
        with pytest.raises(Cancelled):
            view.publish(both, DisplayOptions(), None)
    view.publish(both, DisplayOptions(), None)


def test_a_body_alone_is_of_clay_and_one_of_a_sweep_has_the_color_of_its_rank(
    server: viser.ViserServer, kick: Predictor
) -> None:
    session, view = Session(kick.schema), SceneView(server, 0.2, lambda: None)
    column = Column("alone", kick, kick.rest)
    swept = [replace(column, label=f"{rank}", pinned=session.schema.complete({}), rank=rank) for rank in (0.0, 1.0)]
    columns = Columns.of([column, *swept]).all
    request = ViewRequest(session.schema.complete({}), 0.02, "balanced", columns)
    view.publish(session.frame(request), DisplayOptions(), None)
    colors = [server.scene.get_handle_by_name(f"/world/column_{c.key}/body/part_0") for c in columns]
    assert [c.color for c in colors if isinstance(c, viser.MeshHandle)] == [CLAY, *map(color_of, columns[1:])]
    view.publish(session.frame(request), DisplayOptions(overlay=True), None)
    assert isinstance(colors[0], viser.MeshHandle)
    assert colors[0].color == color_of(columns[0])  # told apart in one place


def test_a_ball_that_flies_higher_than_what_was_framed_stays_in_view(server: viser.ViserServer) -> None:
    rolling = odeform.load("kick")
    session, view = Session(rolling.schema), SceneView(server, 0.2, lambda: None)
    columns = Columns.of([Column("kick", rolling, rolling.rest)]).all
    usual = ViewRequest(session.schema.complete({}), 0.15, "balanced", columns)
    world = server.scene.get_handle_by_name("/world")
    assert isinstance(world, viser.FrameHandle)
    view.publish(session.frame(usual), DisplayOptions(), None)
    assert world.position[2] == 0.0
    hard = replace(usual, parameters=session.schema.complete({"force": 160.0, "mass": 0.4, "elevation": 1.1}))
    centre = rolling.rest.points.mean(axis=0, dtype=float)

    def height(request: ViewRequest) -> float:
        pose = session.frame(request).columns[0].motion.pose(request.time)
        return float(pose[2, :3] @ centre + pose[2, 3] - centre[2])

    times = np.linspace(0.0, 1.0, 61)
    framed = max(height(replace(usual, time=t)) for t in times)
    hard = replace(hard, time=max(times, key=lambda t: height(replace(hard, time=t))))
    view.publish(session.frame(hard), DisplayOptions(), None)
    assert height(hard) > framed + 0.1
    assert height(hard) + world.position[2] == pytest.approx(framed, abs=0.01)
    view.publish(session.frame(hard), DisplayOptions(follow=False), None)
    assert world.position[2] == 0.0


def test_a_truth_is_drawn_as_finely_as_the_prediction_and_pales_when_it_is_over(server: viser.ViserServer) -> None:
    session, view = Session(SCHEMA), SceneView(server, 0.2, lambda: None)
    stub, coarse = StubPredictor(), trimesh.creation.icosphere(1, 0.1)
    sequence = recorded(stub, {"mass": 0.5})
    points = coarse.vertices + np.array([0.0, 0.0, 0.1])
    rising = sequence.times[:, None, None] * [0.0, 0.0, 0.1]
    frames = np.add(points, rising).astype(np.float32)
    weights = np.full(len(points), 1.0 / len(points), np.float32)
    faces = np.asarray(coarse.faces, np.int32)
    record = RecordedMotion(SCHEMA, replace(sequence, vertices=frames, faces=faces, weights=weights))
    columns = Columns.of([Column("stub", stub, stub.rest), Column("truth", record, record.geometry)]).all
    request = ViewRequest(SCHEMA.complete({"mass": 0.5}), 0.0, "balanced", columns)
    view.publish(session.frame(request), DisplayOptions(), None)
    fine, truth = (server.scene.get_handle_by_name(f"/world/column_{c.key}/body/part_0") for c in columns)
    assert isinstance(fine, viser.MeshHandle)
    assert isinstance(truth, viser.MeshHandle)
    assert len(truth.vertices) == len(fine.vertices) > len(points)
    assert truth.opacity is None
    view.publish(session.frame(replace(request, time=record.end + 0.1)), DisplayOptions(), None)
    assert truth.opacity is not None
    lies = RecordedMotion(SCHEMA, replace(record.sequence, vertices=np.repeat(frames[:1], len(frames), axis=0)))
    resting = Columns.of([Column("stub", stub, stub.rest), Column("truth", lies, lies.geometry)]).all
    view.publish(session.frame(replace(request, columns=resting, time=lies.end + 0.1)), DisplayOptions(), None)
    truth = server.scene.get_handle_by_name(f"/world/column_{resting[1].key}/body/part_0")
    assert isinstance(truth, viser.MeshHandle)
    assert truth.opacity is None


def test_beside_others_the_arrow_of_a_push_goes_once_the_body_has_left(server: viser.ViserServer) -> None:
    predictor = PushedPredictor()
    session, view = Session(predictor.schema), SceneView(server, 0.2, lambda: None)
    usual = predictor.complete({"object": "donut"})
    forces = {
        name: value / np.linalg.norm(vector_of(usual, "force")) for name, value in usual.items() if "force" in name
    }
    weak, strong = ({**usual, **{name: of * value for name, value in forces.items()}} for of in (1.0, 30.0))
    columns = Columns.of(
        [Column(name, predictor, predictor.rest, pinned=p) for name, p in (("weak", weak), ("strong", strong))]
    ).all
    request = ViewRequest(weak, 0.5 * PULSE, "balanced", columns)

    def drawn(columns: tuple[Column, ...], time: float) -> list[bool]:
        view.publish(session.frame(replace(request, columns=columns, time=time)), DisplayOptions(), None)
        places = [server.scene.get_handle_by_name(f"/world/column_{c.key}/ground/push") for c in columns]
        return [place.visible for place in places if place is not None]

    assert drawn(columns, 0.5 * PULSE) == [True, True]
    assert drawn(columns, 2.0 * PULSE) == [True, False]
    assert drawn(columns[1:], 2.0 * PULSE) == [True], "alone, it lies over nothing"


def cancelled() -> Box:
    raise Cancelled
