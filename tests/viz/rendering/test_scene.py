"""What is sent to the page for a frame."""

from dataclasses import replace

import numpy as np
import pytest
import viser

from odeform.cancellation import Cancelled
from odeform.models.base import Predictor
from odeform.types import GaussianSplats
from odeform_viz.columns import Column, Columns
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
        patch.setattr("odeform_viz.rendering.scene._height", lambda _: cancelled())
        with pytest.raises(Cancelled):
            view.publish(both, DisplayOptions(), None)
    view.publish(both, DisplayOptions(), None)


def cancelled() -> float:
    raise Cancelled
