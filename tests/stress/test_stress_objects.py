"""The stability of pushed objects, until they rest."""

import json

import pytest

import odeform
from odeform.cli import main
from odeform.models.per_object import PerObject
from odeform.simulation.scenes.user_object import scene_with
from odeform.stress.objects import BEYOND, draws_of, watch
from tests.soft_block import block_object


@pytest.fixture(scope="module")
def model() -> PerObject:
    found = odeform.load("contact-force")
    assert isinstance(found, PerObject)
    return found


def test_draws_are_pushes_of_all_objects_and_past_the_trained_forces(model: PerObject) -> None:
    rows = draws_of(model.schema, 140, 3)
    assert {row["object"] for row in rows} == set(model.schema.objects)
    assert rows == draws_of(model.schema, 140, 3)
    usual = draws_of(model.schema, 140, 4)
    assert rows != usual
    ratios = [row["force_x"] / one["force_x"] for row, one in zip(rows, _trained(model), strict=True)]
    assert max(ratios) > 1.1
    assert 0.0 <= min(ratios) <= max(ratios) <= BEYOND


def test_a_taught_shape_is_drawn_as_its_own_data_are() -> None:
    item = block_object()
    rows = draws_of(scene_with("contact-force", item).schema, 12, 3, item)
    assert {row["object"] for row in rows} == {"block"}
    forces = [sum(row[f"force_{axis}"] ** 2 for axis in "xyz") ** 0.5 for row in rows]
    assert 0.0 < max(forces) <= BEYOND * item.forces[1]


def _trained(model: PerObject) -> list[dict[str, float]]:
    from odeform.simulation.scenes.contact_force import SCENE

    drawn = SCENE.sample(20, 3, model.schema.objects)
    return [row for index in range(20) for row in drawn[index::20]]


def test_a_push_is_watched_until_the_body_rests(model: PerObject) -> None:
    seen = watch(model, (0, model.complete({"object": "donut"})))
    assert (seen.status, seen.non_finite, seen.start_off, seen.held) == ("ok", 0, 0.0, 0.0)
    assert seen.rests
    assert 0.0 < seen.depth < 0.005


def test_what_is_not_finite_counts(model: PerObject, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model, "_solve", lambda *args: 1 / 0)
    assert watch(model, (0, model.complete({"object": "donut"}))).status == "fault: ZeroDivisionError"
    assert watch(model, (0, {**model.complete({"object": "donut"}), "contact_x": float("nan")})).status == "refused"


@pytest.mark.slow
def test_the_command_prints_every_check(capsys: pytest.CaptureFixture[str], tmp_path) -> None:
    main(["stress", "contact-force", "--draws", "14", "--json", str(tmp_path / "stress.json")])
    said = capsys.readouterr().out
    assert "14 cases, 0 non-finite frames" in said
    found = json.loads((tmp_path / "stress.json").read_text())
    assert {"faults", "moving_at_the_end", "held_frames", "shown_below_floor_mm"} <= set(found["checks"])
