"""The state of the page survives a file."""

import json
from collections.abc import Callable

import pytest

from odeform import InputError
from odeform.predictor import load
from odeform_viz.columns import Column, Columns, truth_column
from odeform_viz.session import Looks, Wish
from odeform_viz.state import capture, columns_of, state_from_json, state_to_json

SCENE = "mass-elastic"


@pytest.fixture(scope="module")
def wish() -> Wish:
    model = load(SCENE)
    at = model.schema.complete({"mass": 0.31})
    columns = Columns.of([Column("odeform", model, model.rest, origin=SCENE)])
    columns.add(Column("heavy", model, model.rest, origin=SCENE, pinned={**at, "mass": 0.9}))
    columns.add(truth_column(f"{SCENE}/mass-elastic_00001"))
    columns.show(columns.all[0].key, False)
    return Wish(at, 0.271, "draft", columns.all)


def test_what_is_restored_is_what_was_saved(wish: Wish) -> None:
    looks = Looks(overlay=True, heat=False)
    state = state_from_json(state_to_json(capture(SCENE, wish, looks)), SCENE)
    columns = columns_of(state, wish.columns[0].source.schema, wish.columns[0])
    again = capture(SCENE, Wish(state.parameters, state.time, state.quality, tuple(columns)), looks)
    assert again == state
    assert [c.label for c in columns] == ["odeform", "heavy", "truth"]
    assert [c.shown for c in columns] == [False, True, True]


@pytest.mark.parametrize(
    ("broken", "said"),
    [
        (lambda s: b"\x00\xff", "not a file"),
        (lambda s: json.dumps({**s, "odeform_state": 7}).encode(), "format 1"),
        (lambda s: json.dumps({**s, "scene": "kick"}).encode(), "kick"),
        (lambda s: json.dumps({**s, "surplus": 1}).encode(), "surplus"),
        (lambda s: json.dumps({**s, "columns": [{"origin": "x"}]}).encode(), "expected origin"),
        (lambda s: json.dumps({k: v for k, v in s.items() if k != "time"}).encode(), "time"),
        (lambda s: json.dumps({**s, "time": "soon"}).encode(), "not a file"),
        (lambda s: json.dumps({**s, "time": float("nan")}).encode(), "time in seconds"),
        (lambda s: json.dumps({**s, "columns": [7]}).encode(), "not a file"),
        (lambda s: json.dumps({**s, "columns": []}).encode(), "no model under the sliders"),
        (lambda s: json.dumps([s]).encode(), "format 1"),
    ],
)
def test_other_files_are_refused(wish: Wish, broken: Callable[[dict], bytes], said: str) -> None:
    whole = json.loads(state_to_json(capture(SCENE, wish, Looks())))
    with pytest.raises(InputError, match=said):
        state_from_json(broken(whole), SCENE)


@pytest.mark.parametrize("wrong", [{"parameters": {"mass": "x"}}, {"parameters": [1]}, {"truth": "nowhere/x"}])
def test_wrong_values_are_refused_when_columns_are_made(wish: Wish, wrong: dict) -> None:
    raw = {**json.loads(state_to_json(capture(SCENE, wish, Looks()))), **wrong}
    with pytest.raises(InputError):
        columns_of(state_from_json(json.dumps(raw).encode(), SCENE), wish.columns[0].source.schema, wish.columns[0])


def test_a_missing_checkpoint_is_named(wish: Wish) -> None:
    state = capture(SCENE, wish, Looks())
    lost = json.loads(state_to_json(state))
    lost["columns"][0]["origin"] = "nowhere.safetensors"
    with pytest.raises(InputError, match="nowhere"):
        columns_of(state_from_json(json.dumps(lost).encode(), SCENE), wish.columns[0].source.schema, wish.columns[0])
