"""The state of the page as a JSON file that anyone can open to see the same."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import odeform
from odeform.errors import InputError
from odeform.io import parse_json
from odeform.models.base import Predictor
from odeform.schema import Schema
from odeform.simulation.objects.materials import material_name
from odeform_viz.columns import Column, truth_column
from odeform_viz.fitting import fit_to_json
from odeform_viz.recording.provenance import origin_of
from odeform_viz.user_bodies import user_body_of
from odeform_viz.view import COLOR_BY, DisplayOptions, Sight, ViewRequest

__all__ = ["PageState", "capture", "columns_of", "state_from_json", "state_to_json"]

FORMAT = 1
COLUMN_KEYS = ("origin", "label", "pinned", "shown", "truth")
SHAPE_KEYS = ("origin", "region", "place")


@dataclass(frozen=True)
class PageState:
    """Plain values of one page: slider values, display options, and the columns by their origin.

    A column is `{"origin", "label", "pinned", "shown", "truth"}`, of a checkpoint or of a sequence DATASET/NAME; in a
    sweep it has a `"rank"` too. `shape` is `{"origin", "region", "place"}` of a loaded shape; a soft body has its
    `"material"` too, as `material_of` reads it.
    """

    scene: str
    parameters: Mapping[str, float]
    time: float
    quality: str
    columns: tuple[Mapping[str, Any], ...] = ()
    shape: Mapping[str, Any] | None = None
    display: DisplayOptions = field(default_factory=DisplayOptions)
    notes: tuple[str, ...] = ()
    """Says in words what could not be saved."""
    speed: float | None = None
    """Of playing, in times real time; None for the page's own."""
    loop: bool = True
    camera: Sight | None = None
    """Where the camera of the browser that saved it was; None for the page's own."""


def capture(
    scene: str,
    request: ViewRequest,
    display: DisplayOptions,
    speed: float | None = None,
    loop: bool = True,
    camera: Sight | None = None,
) -> PageState:
    """The state that the arguments describe. What is in no file cannot be saved; the notes say so."""
    truth = next((c for c in request.columns if c.truth), None)
    fit = next((c.fit for c in request.columns if c.fit), None)
    body = next((b for c in request.columns if (b := user_body_of(c.predictor))), None)
    notes = []
    if truth and not truth.origin:
        notes.append("The truth is not from a data set and was not saved.")
    if fit and not fit.origin:
        notes.append("The shape was uploaded and was not saved.")
    columns = tuple(
        {
            "origin": origin_of(c),
            "label": c.label,
            "pinned": c.pinned and dict(c.pinned),
            "shown": c.visible,
            "truth": c.truth is not None,
            **({} if c.rank is None else {"rank": c.rank}),
        }
        for c in request.columns
        if c.predictor or c.origin
    )
    material = {} if body is None else {"material": material_name(body.item.material)}
    shape = {**fit_to_json(fit), **material} if fit and fit.origin else None
    of_request = (scene, request.parameters, request.time, request.quality)
    return PageState(*of_request, columns, shape, display, tuple(notes), speed, loop, camera)


def columns_of(state: PageState, schema: Schema) -> list[Column]:
    """The columns of a state, with trained bodies. `InputError` where a checkpoint or data set is missing."""
    schema.complete(state.parameters)
    models = {c["origin"]: odeform.load(c["origin"]) for c in state.columns if not c["truth"]}
    return [_column(raw, models, schema) for raw in state.columns]


def _column(raw: Mapping[str, Any], models: Mapping[str, Predictor], schema: Schema) -> Column:
    visible = bool(raw["shown"])
    if raw["truth"]:
        return replace(truth_column(raw["origin"]), visible=visible)
    model = models[raw["origin"]]
    pinned = None if raw["pinned"] is None else schema.complete(raw["pinned"])
    return Column(str(raw["label"]), model, model.rest, pinned, raw["origin"], visible=visible, rank=raw.get("rank"))


def state_to_json(state: PageState) -> bytes:
    """The content of a state file, in UTF-8; `state_from_json` reads it."""
    display = state.display
    raw = {
        "odeform_state": FORMAT,
        "scene": state.scene,
        "parameters": dict(state.parameters),
        "time": state.time,
        "quality": state.quality,
        "columns": state.columns,
        "shape": state.shape,
        "overlay": display.overlay,
        "heat": display.color_by == "error",
        "colors": display.color_by,
        "exaggeration": display.exaggeration,
        "ghost": display.ghost,
        "wireframe": display.wireframe,
        "follow": display.follow,
        "momentary": display.momentary,
        "speed": state.speed,
        "loop": state.loop,
        "camera": state.camera and {"position": state.camera.position, "look_at": state.camera.look_at},
        "notes": state.notes,
    }
    return json.dumps(raw, indent=1).encode()


def state_from_json(data: bytes, scene: str) -> PageState:
    """Reads a state; raises `InputError` for anything but one of that scene."""
    try:
        raw = parse_json(data, "state: not a state file of ODeform")
        if not isinstance(raw, dict) or raw.pop("odeform_state", None) != FORMAT:
            raise InputError(f"state: expected a state file of ODeform, format {FORMAT}")
        raw["columns"], raw["notes"] = tuple(raw["columns"]), tuple(raw["notes"])
        display, sight = _display(raw), raw.pop("camera", None)
        camera = None if sight is None else Sight.of(sight["position"], sight["look_at"])
        state = PageState(**raw, display=display, camera=camera)
        _check(state, scene)
        return state
    except InputError:
        raise
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError) as error:
        raise InputError(f"state: not a state file of ODeform: {error}") from None


def _display(raw: dict[str, Any]) -> DisplayOptions:
    """Takes the display options out of a state; files of earlier versions have only some."""
    default = DisplayOptions()
    colors = raw.pop("colors", default.color_by if raw.get("heat", True) else COLOR_BY[0])
    raw.pop("heat", None)
    exaggeration = float(raw.pop("exaggeration", default.exaggeration))
    if colors not in COLOR_BY or not 1.0 <= exaggeration <= 10.0:
        raise InputError(f"state: expected colors {', '.join(COLOR_BY)}, got {colors!r}, exaggeration {exaggeration}")
    display = DisplayOptions(color_by=colors, exaggeration=exaggeration)
    boxes = {name: raw.pop(name) for name in ("overlay", "follow", "ghost", "wireframe", "momentary") if name in raw}
    return replace(display, **{name: bool(value) for name, value in boxes.items()})


def _check(state: PageState, scene: str) -> None:
    if not math.isfinite(state.time):
        raise InputError(f"state: expected a time in seconds, got {state.time}")
    if not isinstance(state.parameters, dict):
        raise InputError(f"state: expected parameters by name, got {state.parameters}")
    if state.scene != scene:
        raise InputError(f"state: expected scene {scene}, got {state.scene}")
    for column in state.columns:
        if set(column) - {"rank"} != set(COLUMN_KEYS):
            raise InputError(f"state: a column has {', '.join(column)}; expected {', '.join(COLUMN_KEYS)}")
        if not isinstance(column["pinned"], dict | None) or not isinstance(column["origin"], str):
            raise InputError(f"state: column {column['label']}: expected an origin and parameters by name")
        rank = column.get("rank", 0.0)
        if not isinstance(rank, int | float) or not 0.0 <= rank <= 1.0:
            raise InputError(f"state: column {column['label']}: expected a rank from 0 to 1, got {rank}")
    if state.speed is not None and not (math.isfinite(state.speed) and state.speed > 0.0):
        raise InputError(f"state: expected a speed above zero, got {state.speed}")
    if state.shape is not None and set(state.shape) - {"material"} != set(SHAPE_KEYS):
        raise InputError(f"state: shape: expected {', '.join(SHAPE_KEYS)}")
    if not isinstance(state.quality, str):
        raise InputError(f"state: expected the name of a quality, got {state.quality}")
    if all(column["truth"] or column["pinned"] is not None for column in state.columns):
        raise InputError("state: expected a model under the sliders, got none")
