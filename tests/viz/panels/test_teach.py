"""*Teach this shape*: the panel of a shape of the user's own."""

import os
import signal
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from odeform.dataset.store import open_dataset
from odeform.geometry.shape import FittedShape
from odeform.geometry.similarity import Similarity
from odeform.models.modal.elastic_body import elastic_body
from odeform.models.registry import load
from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.columns import Column, Columns
from odeform_viz.panels import teach
from odeform_viz.panels.teach import describe_lesson, describe_result, lesson_folder
from odeform_viz.panels.user_body import UserBodyPanel
from odeform_viz.runtime.jobs import Lesson, Report
from odeform_viz.state import capture, state_from_json, state_to_json
from odeform_viz.user_bodies import (
    TaughtBodyPredictor,
    UserBody,
    UserBodyPredictor,
    user_body_of,
    with_user_body,
    without_user_body,
)
from odeform_viz.view import DisplayOptions, ViewRequest
from tests.soft_block import block_object

View = tuple[App, LoopbackClient]
PATIENCE = 600.0  # s, for a busy machine


def endless(report: Report, *_: object) -> None:
    for step in range(10_000):
        report(Lesson(step % 10, 10))
        time.sleep(0.01)


def failing(report: Report, *_: object) -> None:
    raise OSError(28, "No space left on device")


def body_of(young: float = 4e4) -> UserBody:
    item = block_object()
    item = replace(item, material=replace(item.material, young=young))
    rest = item.rest_mesh()
    return UserBody(item, elastic_body(item, 60), "pillow", FittedShape(rest, None, Similarity(), rest, None, 0.0))


@pytest.fixture
def view(tmp_path: Path) -> Iterator[View]:
    model = load("contact-force")
    columns = with_user_body([Column("guess", model, model.rest, origin="contact-force")], body_of())
    app = App(columns, port=0, workspace=tmp_path)
    try:
        with LoopbackClient(app.server.get_port()) as client:
            yield app, client
    finally:
        app.close()


@pytest.mark.parametrize(
    ("lesson", "expected"),
    [
        (Lesson(4, 20), "Simulated 4 of 20 motions; 80 s left, then up to 5 minutes of learning."),
        (Lesson(0, 20), "Simulated 0 of 20 motions; then up to 5 minutes of learning."),
        (Lesson(20, 20, 0.5, "It learns."), "Learning from 20 motions; at most 2 min left. It learns."),
    ],
)
def test_progress_says_what_is_done_and_how_long_it_takes(lesson: Lesson, expected: str) -> None:
    assert describe_lesson(lesson, 20.0, 0) == expected


def test_the_result_has_the_errors_before_and_after() -> None:
    said = describe_result(8.34, 1.78, 3.25, "taught/shoe-123456")
    assert "**8.3 mm → 1.8 mm**" in said
    assert "in 3.2 minutes" in said
    assert "taught/shoe-123456/model.safetensors" in said


def test_bodies_of_other_materials_are_kept_apart() -> None:
    assert lesson_folder(body_of()) == lesson_folder(body_of())
    assert lesson_folder(body_of()) != lesson_folder(body_of(5e4))
    assert lesson_folder(body_of()).startswith("taught/block-")


@pytest.mark.slow
def test_it_is_offered_for_a_shape_of_the_users_own_only(view: View) -> None:
    app, client = view
    assert client.until(lambda: client.controls["Teach this shape"].visible)
    client.click("Back to the trained bodies")
    assert client.until(lambda: not client.controls["Teach this shape"].visible)
    assert app.columns.all[0].predictor is not None


@pytest.mark.slow
def test_a_cancelled_lesson_and_one_that_fails_can_be_begun_again(view: View, monkeypatch: pytest.MonkeyPatch) -> None:
    _, client = view
    monkeypatch.setattr(teach, "simulate_lessons", endless)
    client.click("Teach this shape")
    assert client.until(lambda: "of 10 motions" in client.text(), PATIENCE)
    client.click("Cancel teaching")
    assert client.until(lambda: "Cancelled" in client.text() and client.controls["Teach this shape"].visible)
    monkeypatch.setattr(teach, "simulate_lessons", failing)
    client.click("Teach this shape")
    assert client.until(lambda: "No space left on device" in client.text(), PATIENCE)
    assert client.until(lambda: client.controls["Teach this shape"].visible)


@pytest.mark.slow
def test_a_lesson_that_is_cancelled_and_one_that_is_killed_go_on_where_they_were(view: View, tmp_path: Path) -> None:
    app, client = view
    client.set("motions", "10")
    client.click("Teach this shape")
    assert client.until(lambda: "Simulated 2 of 10" in client.text(), PATIENCE)
    client.click("Cancel teaching")
    assert client.until(lambda: "Cancelled" in client.text())
    (folder,) = (tmp_path / "taught").iterdir()
    before = {entry.name: entry.sha256 for entry in open_dataset(folder).entries}
    assert before, "a motion that is simulated is kept"
    client.click("Teach this shape")
    teaching = app.panel(UserBodyPanel)._teaching
    # before its process learns, the text that the last simulated motion left says the same
    assert client.until(lambda: teaching._bar.value > 50.0, PATIENCE)
    assert client.until(lambda: "Learning from 10 motions" in client.text())
    assert before.items() <= {entry.name: entry.sha256 for entry in open_dataset(folder).entries}.items()
    job = teaching._job
    assert job is not None
    assert job._process.pid is not None
    os.kill(job._process.pid, signal.SIGKILL)
    assert client.until(lambda: "ended by SIGKILL" in client.text() and "is kept" in client.text())
    client.click("Teach this shape")
    assert client.until(lambda: "Taught in" in client.text(), PATIENCE), client.text()


@pytest.mark.slow
def test_the_refined_model_stands_beside_the_first_guess(view: View, tmp_path: Path) -> None:
    app, client = view
    client.set("motions", "10")
    client.click("Teach this shape")
    assert client.until(lambda: "Taught in" in client.text(), PATIENCE), client.text()
    assert [column.label for column in app.columns.all] == ["guess", "refined"]
    guess, refined = app.columns.all
    assert isinstance(guess.predictor, UserBodyPredictor)
    assert isinstance(refined.predictor, TaughtBodyPredictor)
    assert user_body_of(refined.predictor) is user_body_of(guess.predictor)
    assert Path(refined.origin).is_relative_to(tmp_path)
    assert load(refined.origin).schema.objects == ("block",)
    assert client.until(lambda: (f := app.presenter.frame) is not None and len(f.columns) == 2)
    # what is done is not done again
    client.click("Teach this shape")
    assert client.until(lambda: not client.controls["Cancel teaching"].visible, PATIENCE)
    assert len(app.columns.all) == 2
    assert with_user_body(app.columns.all, body_of())[1].label == "refined"
    assert len(with_user_body(app.columns.all, body_of(5e4))) == 1, "it was taught another material"
    assert len(without_user_body(app.columns.all)) == 1


def test_a_saved_page_says_of_what_material_a_shape_is() -> None:
    model, body = load("contact-force"), body_of(6e4)
    body = replace(body, fit=replace(body.fit, origin="shape.ply"))
    columns = with_user_body([Column("guess", model, model.rest, origin="contact-force")], body)
    request = ViewRequest(model.complete({}), 0.0, "balanced", Columns.of(columns).all)
    state = state_from_json(state_to_json(capture("contact-force", request, DisplayOptions())), "contact-force")
    assert state.shape is not None
    assert state.shape["material"] == f"60:{body.item.material.density:g}"
