"""The state of the page survives a file."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from odeform import InputError
from odeform.geometry.region import Sphere
from odeform.geometry.shape import fit_to
from odeform.geometry.similarity import UPRIGHT, Similarity
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform_viz.columns import Column, Columns, truth_column
from odeform_viz.fitting import fit_from_json, fit_to_json, shape_from
from odeform_viz.state import capture, columns_of, state_from_json, state_to_json
from odeform_viz.view import DisplayOptions, Sight, ViewRequest

SCENE = "mass-elastic"
MODEL = {"origin": SCENE, "label": "m", "pinned": None, "shown": True, "truth": False}
TRUTH = {**MODEL, "origin": "nowhere/x", "truth": True}


@pytest.fixture(scope="module")
def view_request() -> ViewRequest:
    model = load(SCENE)
    at = model.schema.complete({"mass": 0.31})
    columns = Columns.of([Column("odeform", model, model.rest, origin=SCENE)])
    columns.add(Column("heavy", model, model.rest, origin=SCENE, pinned={**at, "mass": 0.9}))
    columns.add(truth_column(f"{SCENE}/mass-elastic_00001"))
    columns.set_visible(columns.all[0].key, False)
    return ViewRequest(at, 0.271, "draft", columns.all)


def test_what_is_restored_is_what_was_saved(view_request: ViewRequest) -> None:
    looks = DisplayOptions(overlay=True, color_by="strain", exaggeration=2.5, ghost=True, momentary=True)
    sight = Sight.of((1.0, 2.0, 0.5), (0.0, 0.1, 0.2))
    state = state_from_json(state_to_json(capture(SCENE, view_request, looks, 0.5, False, sight)), SCENE)
    columns = columns_of(state, view_request.columns[0].source.schema)
    shown = ViewRequest(state.parameters, state.time, state.quality, tuple(columns))
    assert capture(SCENE, shown, looks, 0.5, False, sight) == state
    assert state.display.momentary
    assert [c.label for c in columns] == ["odeform", "heavy", "truth"]
    assert [c.visible for c in columns] == [False, True, True]


@pytest.mark.parametrize(
    ("broken", "said"),
    [
        (lambda s: b"\x00\xff", "not a state file"),
        (lambda s: json.dumps({**s, "odeform_state": 7}).encode(), "format 1"),
        (lambda s: json.dumps({**s, "scene": "kick"}).encode(), "kick"),
        (lambda s: json.dumps({**s, "surplus": 1}).encode(), "surplus"),
        (lambda s: json.dumps({**s, "columns": [{"origin": "x"}]}).encode(), "expected origin"),
        (lambda s: json.dumps({k: v for k, v in s.items() if k != "time"}).encode(), "time"),
        (lambda s: json.dumps({**s, "time": "soon"}).encode(), "not a state file"),
        (lambda s: json.dumps({**s, "time": float("nan")}).encode(), "time in seconds"),
        (lambda s: json.dumps({**s, "speed": -1.0}).encode(), "speed above zero"),
        (
            lambda s: json.dumps({**s, "camera": {"position": [0, 0, 1], "look_at": [0, 0]}}).encode(),
            "camera: expected",
        ),
        (lambda s: json.dumps({**s, "camera": {"position": 3}}).encode(), "not a state file"),
        (lambda s: json.dumps({**s, "columns": [7]}).encode(), "not a state file"),
        (lambda s: json.dumps({**s, "columns": []}).encode(), "a model under the sliders"),
        (lambda s: json.dumps([s]).encode(), "format 1"),
    ],
)
def test_other_files_are_refused(view_request: ViewRequest, broken: Callable[[dict], bytes], said: str) -> None:
    whole = json.loads(state_to_json(capture(SCENE, view_request, DisplayOptions())))
    with pytest.raises(InputError, match=said):
        state_from_json(broken(whole), SCENE)


@pytest.mark.parametrize("wrong", [{"parameters": {"mass": "x"}}, {"parameters": [1]}, {"columns": [MODEL, TRUTH]}])
def test_wrong_values_are_refused_when_columns_are_made(view_request: ViewRequest, wrong: dict) -> None:
    raw = {**json.loads(state_to_json(capture(SCENE, view_request, DisplayOptions()))), **wrong}
    with pytest.raises(InputError):
        columns_of(state_from_json(json.dumps(raw).encode(), SCENE), view_request.columns[0].source.schema)


def test_a_missing_checkpoint_is_named(view_request: ViewRequest) -> None:
    state = capture(SCENE, view_request, DisplayOptions())
    lost = json.loads(state_to_json(state))
    lost["columns"][0]["origin"] = "nowhere.safetensors"
    with pytest.raises(InputError, match="nowhere"):
        columns_of(state_from_json(json.dumps(lost).encode(), SCENE), view_request.columns[0].source.schema)


def test_a_shape_its_part_and_its_place_are_kept(view_request: ViewRequest) -> None:
    (model,) = {c.predictor for c in view_request.columns if c.predictor and c.pinned is None}
    guessed = shape_from("volleyball", model.rest)
    turned = Similarity(
        1.1 * guessed.transform.factor, UPRIGHT["+x"] @ guessed.transform.rotation, guessed.transform.shift
    )
    region = Sphere(guessed.region.centre + 0.5 * guessed.region.radius, guessed.region.radius)
    fit = replace(fit_to(guessed.source, model.rest, region, transform=turned), origin="volleyball")
    columns = Columns.of([replace(view_request.columns[0], geometry=fit.geometry, fit=fit)])
    state = state_from_json(
        state_to_json(capture(SCENE, replace(view_request, columns=columns.all), DisplayOptions())), SCENE
    )
    assert state.shape is not None
    again = fit_from_json(state.shape, model.rest)
    np.testing.assert_array_equal(again.geometry.points, fit.geometry.points)
    np.testing.assert_array_equal(again.static.points, fit.static.points)
    assert again.origin == "volleyball"
    # what was uploaded is in no file here
    nowhere = replace(columns.all[0], fit=replace(fit, origin=""))
    lost = capture(SCENE, replace(view_request, columns=(nowhere,)), DisplayOptions())
    assert lost.shape is None
    assert "uploaded" in lost.notes[0]


@pytest.mark.parametrize(
    "wrong",
    [
        {"origin": "nowhere.ply"},
        {"region": {"cone": {}}},
        {"region": 7},
        {"place": {"factor": 0.0, "rotation": np.eye(3).tolist(), "shift": [0, 0, 0]}},
        {"place": {"factor": 1.0, "rotation": np.ones((3, 3)).tolist(), "shift": [0, 0, 0]}},
        {"place": {}},
    ],
)
def test_a_wrong_shape_is_refused(view_request: ViewRequest, wrong: dict) -> None:
    body = next(c.predictor.rest for c in view_request.columns if c.predictor)
    whole = fit_to_json(shape_from("volleyball", body))
    with pytest.raises(InputError):
        fit_from_json({**whole, **wrong}, body)


def test_an_older_state_file_opens(kick: Predictor) -> None:
    state = state_from_json((Path(__file__).parent / "state-0.1.json").read_bytes(), "kick")
    assert state.time == 0.02
    assert state.display == DisplayOptions(overlay=True, color_by="error", follow=False)
    columns = columns_of(state, kick.schema)
    assert [(column.label, column.visible) for column in columns] == [("odeform", True), ("heavy", True)]
    assert columns[1].pinned == kick.schema.complete({"mass": 0.9})
