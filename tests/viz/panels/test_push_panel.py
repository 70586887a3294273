"""Choosing an object, clicking a contact and setting a force, as a user does."""

import math

import numpy as np
import pytest
from pushed import NAMES, PushedPredictor

import odeform
from odeform.errors import InputError
from odeform.geometry.contact import nearest_on
from odeform.geometry.push import push_of
from odeform.simulation.contacts import push_from, vector_of
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.columns import Column
from odeform_viz.panels.push import PushPanel
from odeform_viz.pushing import push_shown
from odeform_viz.runtime import notices

View = tuple[App, LoopbackClient]
DONUT, PILLOW = NAMES


@pytest.fixture
def pushed(serve) -> View:
    model = PushedPredictor()
    return serve(Column("stub", model, model.rest, origin=""), moment=0.02)


def surface(app: App, name: str):
    predictor = app.page.model.predictor
    assert predictor is not None
    return predictor.rest_of({"object": name})


def test_the_sliders_are_the_pushs_and_not_the_scenes(pushed: View) -> None:
    app, client = pushed
    assert {"object", "force (N)", "tilt up (°)", "tilt sideways (°)"} <= set(client.controls)
    assert not any(label.startswith(("contact_x", "force_x")) for label in client.controls)
    assert set(app.request().parameters) == {"object", *(p.name for p in app.page.schema.parameters)}


def test_each_object_has_a_push_on_its_own_surface_and_keeps_it(pushed: View) -> None:
    app, client = pushed
    client.set("force (N)", 2.5)
    client.set("object", PILLOW)
    assert client.until(lambda: app.request().parameters["object"] == PILLOW)
    parameters = app.request().parameters
    body = surface(app, PILLOW)
    assert nearest_on(body, vector_of(parameters, "contact")).distance < 1e-6
    assert app.request().columns[0].geometry is body
    assert client.until(lambda: "on the pillow's" in client.text())
    client.set("object", DONUT)
    assert client.until(lambda: app.request().parameters["object"] == DONUT)
    assert np.linalg.norm(vector_of(app.request().parameters, "force")) == pytest.approx(2.5)


def test_a_tilt_turns_the_force_off_the_normal(pushed: View) -> None:
    app, client = pushed
    client.set("force (N)", 3.0)
    client.set("tilt up (°)", 20.0)
    body = surface(app, DONUT)
    assert client.until(lambda: math.degrees(push_from(app.request().parameters, body).angle) == pytest.approx(20.0))
    assert push_from(app.request().parameters, body).strength == pytest.approx(3.0)
    assert client.until(lambda: "20° from straight in" in client.text())
    client.set("tilt sideways (°)", 50.0)
    assert client.until(lambda: "direction (trained up to 45°" in client.text())


def test_a_click_moves_the_contact_and_keeps_the_force_in_its_frame(pushed: View) -> None:
    app, client = pushed
    client.set("tilt up (°)", 20.0)
    body, panel = surface(app, DONUT), app.panel(PushPanel)
    assert client.until(lambda: math.degrees(push_from(app.request().parameters, body).up) == pytest.approx(20.0))
    before = push_from(app.request().parameters, body)
    point = np.asarray(body.points[body.points[:, 0].argmax()], dtype=float)
    panel.pick(app.page.model, point)
    after = push_from(app.request().parameters, body)
    assert np.allclose(after.contact.point, point, atol=1e-4)
    assert (after.strength, after.up) == (pytest.approx(before.strength), pytest.approx(before.up))
    assert not np.allclose(after.force, before.force)


def test_clicks_that_move_nothing_say_why_but_on_the_floor(pushed: View, monkeypatch: pytest.MonkeyPatch) -> None:
    app, _ = pushed
    said: list[str] = []
    monkeypatch.setattr(notices.Notices, "show", lambda _, title, message: said.append(message))
    before = app.request().parameters
    body, panel = surface(app, DONUT), app.panel(PushPanel)
    panel.pick(None, np.zeros(3))
    panel.pick(app.page.model, body.points[body.points[:, 2].argmin()].astype(float))
    (why,) = said
    assert "does not fit" in why
    assert app.request().parameters == before


def test_a_push_beyond_training_is_extrapolated_in_every_place(pushed: View) -> None:
    _, client = pushed
    assert client.until(lambda: "inside the trained range" in client.text())
    client.set("tilt up (°)", 58.0)
    assert client.until(lambda: "direction (trained up to 45° from straight in)" in client.text())
    assert client.until(lambda: "direction beyond the trained range" in client.text())
    assert client.until(lambda: "inside the trained range" not in client.text())


def test_no_force_is_said(pushed: View) -> None:
    _, client = pushed
    client.set("force (N)", 0.0)
    assert client.until(lambda: "no force" in client.text())


def test_the_arrow_is_dragged_while_the_body_rests(pushed: View) -> None:
    app, _ = pushed
    panel, start = app.panel(PushPanel), app.page.schema.window.start
    frame = app.presenter.frame
    assert frame is not None
    shown = push_shown(frame.columns[0].column, frame.columns[0].motion)
    assert shown is not None
    wanted = push_of(shown.push.contact, 3.7 * shown.push.direction)
    tail = shown.centre - (shown.contacts.radius + 3.7 * shown.unit) * wanted.direction
    panel.pull(shown, tail, "start")
    assert app.clock.time() == start
    assert np.allclose(vector_of(app.request().parameters, "force"), wanted.force, atol=1e-6)
    panel.pull(shown, shown.centre, "update")
    assert not vector_of(app.request().parameters, "force").any()
    panel.pull(shown, tail, "end")
    assert app.clock.time() == 0.02


def test_parameters_are_kept_exactly_until_a_slider_moves(pushed: View) -> None:
    app, client = pushed
    panel = app.panel(PushPanel)
    body = surface(app, PILLOW)
    contact = body.points[body.points[:, 2].argmax()].astype(float)
    given = {"object": PILLOW, **{f"contact_{a}": float(x) for a, x in zip("xyz", contact, strict=True)}}
    given |= {"force_x": 0.123456, "force_y": -0.2, "force_z": -2.3456789}
    panel.set(given)
    assert app.request().parameters == given
    assert client.until(lambda: client.controls["object"].value == PILLOW)
    with pytest.raises(InputError, match="unknown object"):
        panel.set({"object": "brick"})
    client.set("force (N)", 4.0)
    assert client.until(lambda: np.linalg.norm(vector_of(app.request().parameters, "force")) == pytest.approx(4.0))


def test_mass_and_stiffness_are_sliders_of_the_object(serve) -> None:
    model = odeform.load("contact-force")
    app, client = serve(Column("odeform", model, model.rest, origin="contact-force"), moment=0.02)
    own = app.request().parameters
    before = app.request().columns[0].geometry
    client.set("mass (kg)", 1.4)
    assert client.until(lambda: app.request().parameters["mass"] == 1.4)
    assert app.request().parameters == {**own, "mass": 1.4}, "nothing else changes"
    heavy = app.request().columns[0].geometry
    assert heavy is not before, "it rests anew"
    assert heavy.points[:, 2].max() < before.points[:, 2].max()
    client.set("stiffness (kPa)", 150.0)
    assert client.until(lambda: app.request().parameters["young"] == 150.0)
    client.set("object", "chip")
    assert client.until(lambda: app.request().parameters["object"] == "chip")
    assert app.request().parameters["mass"] == pytest.approx(0.0041, rel=0.02)


class ThinOnTop(PushedPredictor):
    """A body that takes a tenth of the force on its upper half."""

    def force_range(self, parameters):
        weakest, strongest = super().force_range(parameters)
        part = 0.1 if parameters.get("contact_z", 0.0) > 0.03 else 1.0
        return part * weakest, part * strongest


def test_where_a_body_is_thin_a_click_pushes_less_and_says_so(serve) -> None:
    model = ThinOnTop()
    app, client = serve(Column("stub", model, model.rest, origin=""), moment=0.02)
    panel, body = app.panel(PushPanel), surface(app, DONUT)

    def strength() -> float:
        return float(np.linalg.norm(vector_of(app.request().parameters, "force")))

    def side_and_top() -> tuple[np.ndarray, np.ndarray]:
        points = body.points.astype(float)
        return points[np.abs(points[:, 2] - 0.025).argmin()], points[points[:, 2].argmax()]

    side, top = side_and_top()
    panel.pick(app.page.model, side)
    client.set("force (N)", 3.0)
    assert client.until(lambda: strength() == pytest.approx(3.0))
    panel.pick(app.page.model, top)
    assert strength() == pytest.approx(0.3)
    assert client.until(lambda: "Here the body is thin: 0.1 to 0.4 N suit it, elsewhere up to 4 N" in client.text())
    panel.pick(app.page.model, side)
    assert strength() == pytest.approx(3.0)
    assert client.until(lambda: "Here the body is thin" not in client.text())
