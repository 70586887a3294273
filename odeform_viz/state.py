"""The whole state of the page as a file: who opens it sees the same."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import odeform
from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.schema import Schema
from odeform_viz.columns import Column, truth_column
from odeform_viz.fitting import fit_to_json
from odeform_viz.recording.provenance import origin_of
from odeform_viz.session import DisplayOptions, ViewRequest

__all__ = ["PageState", "capture", "columns_of", "state_from_json", "state_to_json"]

FORMAT = 1


@dataclass(frozen=True)
class PageState:
    """Plain values: what the sliders say, and the columns by where they come from.

    A column is `{"origin", "label", "pinned", "shown", "truth"}`, of a checkpoint or of a sequence DATASET/NAME;
    `shape` is `{"origin", "region", "place"}` of a foreign shape.
    """

    scene: str
    parameters: Mapping[str, float]
    time: float
    quality: str
    columns: tuple[Mapping[str, Any], ...] = ()
    shape: Mapping[str, Any] | None = None
    overlay: bool = False
    heat: bool = True
    follow: bool = True
    notes: tuple[str, ...] = field(default=())
    """What the file could not hold."""


def capture(scene: str, request: ViewRequest, looks: DisplayOptions) -> PageState:
    """What a request says, in plain values. What is in no file here cannot be kept, and the notes say so."""
    truth = next((c for c in request.columns if c.truth), None)
    fit = next((c.fit for c in request.columns if c.fit), None)
    lost = {
        "the truth was simulated on the spot and is not kept": truth and not truth.origin,
        "the shape was uploaded and is not kept": fit and not fit.origin,
    }
    return PageState(
        scene,
        request.parameters,
        request.time,
        request.quality,
        tuple(
            {
                "origin": origin_of(c),
                "label": c.label,
                "pinned": c.pinned and dict(c.pinned),
                "shown": c.shown,
                "truth": c.truth is not None,
            }
            for c in request.columns
            if c.predictor or c.origin
        ),
        fit_to_json(fit) if fit and fit.origin else None,
        looks.overlay,
        looks.heat,
        looks.follow,
        tuple(note for note, so in lost.items() if so),
    )


def columns_of(state: PageState, schema: Schema) -> list[Column]:
    """The columns of a state, of the bodies they were trained on. `InputError` where a checkpoint is missing."""
    schema.complete(state.parameters)
    models = {c["origin"]: odeform.load(c["origin"]) for c in state.columns if not c["truth"]}
    return [_column(raw, models, schema) for raw in state.columns]


def _column(raw: Mapping[str, Any], models: Mapping[str, Predictor], schema: Schema) -> Column:
    if raw["truth"]:
        return replace(truth_column(raw["origin"]), shown=bool(raw["shown"]))
    model = models[raw["origin"]]
    pinned = None if raw["pinned"] is None else schema.complete(raw["pinned"])
    shown = bool(raw["shown"])
    return Column(str(raw["label"]), model, model.rest, pinned=pinned, origin=raw["origin"], shown=shown)


def state_to_json(state: PageState) -> bytes:
    return json.dumps({"odeform_state": FORMAT, **vars(state)}, indent=1).encode()


def state_from_json(data: bytes, scene: str) -> PageState:
    """`InputError` for anything that is not a state of that scene."""
    try:
        raw = json.loads(data)
        if not isinstance(raw, dict) or raw.pop("odeform_state", None) != FORMAT:
            raise InputError(f"state: expected a file that ODeform saved, of format {FORMAT}")
        raw["columns"], raw["notes"] = tuple(raw["columns"]), tuple(raw["notes"])
        state = PageState(**raw)
        if not math.isfinite(state.time):
            raise InputError(f"state: expected a time in seconds, got {state.time}")
        if not isinstance(state.parameters, dict):
            raise InputError(f"state: expected parameters by name, got {state.parameters}")
        if state.scene != scene:
            raise InputError(f"state: it is of scene {state.scene}, not {scene}")
        for column in state.columns:
            if set(column) != {"origin", "label", "pinned", "shown", "truth"}:
                wanted = "expected origin, label, pinned, shown, truth"
                raise InputError(f"state: a column with {', '.join(column)}; {wanted}")
            if not isinstance(column["pinned"], dict | None) or not isinstance(column["origin"], str):
                raise InputError(f"state: column {column['label']}: expected a name and parameters by name")
        if state.shape is not None and set(state.shape) != {"origin", "region", "place"}:
            raise InputError("state: a shape; expected its origin, region and place")
        if not isinstance(state.quality, str):
            raise InputError(f"state: expected the name of a quality, got {state.quality}")
        if all(column["truth"] or column["pinned"] is not None for column in state.columns):
            raise InputError("state: no model under the sliders")
        return state
    except InputError:
        raise
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise InputError(f"state: not a file that ODeform saved: {error}") from None
