"""The whole state of the page as a file: who opens it sees the same."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import odeform
from odeform.errors import InputError
from odeform.schema import Schema
from odeform_viz.columns import Column, truth_column
from odeform_viz.session import Looks, Wish
from odeform_viz.shaping import fit_to_json

__all__ = ["PageState", "capture", "columns_of", "state_from_json", "state_to_json"]

FORMAT = 1


@dataclass(frozen=True)
class PageState:
    """Plain values: what the sliders say, and the columns by where they come from.

    A column is `{"origin", "label", "pinned", "shown"}`; `truth` is the DATASET/NAME of a sequence, or empty;
    `shape` is `{"origin", "region", "place"}` of a foreign shape.
    """

    scene: str
    parameters: Mapping[str, float]
    time: float
    quality: str
    columns: tuple[Mapping[str, Any], ...] = ()
    truth: str = ""
    shape: Mapping[str, Any] | None = None
    overlay: bool = False
    heat: bool = True
    follow: bool = True
    notes: tuple[str, ...] = field(default=())
    """What the file could not hold."""


def capture(scene: str, wish: Wish, looks: Looks) -> PageState:
    """What a wish says, in plain values. What is in no file here cannot be kept, and the notes say so."""
    truth = next((c for c in wish.columns if c.truth), None)
    fit = next((c.fit for c in wish.columns if c.fit), None)
    lost = {
        "the truth was simulated on the spot and is not kept": truth and not truth.origin,
        "the shape was uploaded and is not kept": fit and not fit.origin,
    }
    return PageState(
        scene,
        wish.parameters,
        wish.time,
        wish.quality,
        tuple(
            {"origin": c.origin, "label": c.label, "pinned": c.pinned and dict(c.pinned), "shown": c.shown}
            for c in wish.columns
            if c.predictor
        ),
        truth.origin if truth else "",
        fit_to_json(fit) if fit and fit.origin else None,
        looks.overlay,
        looks.heat,
        looks.follow,
        tuple(note for note, so in lost.items() if so),
    )


def columns_of(state: PageState, schema: Schema) -> list[Column]:
    """The columns of a state, of the bodies they were trained on. `InputError` where a checkpoint is missing."""
    schema.complete(state.parameters)
    models = {name: odeform.load(str(name)) for name in {column["origin"] for column in state.columns}}
    columns = [
        Column(
            str(c["label"]),
            models[c["origin"]],
            models[c["origin"]].rest,
            pinned=None if c["pinned"] is None else schema.complete(c["pinned"]),
            origin=str(c["origin"]),
            shown=bool(c["shown"]),
        )
        for c in state.columns
    ]
    return [*columns, truth_column(state.truth)] if state.truth else columns


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
            if set(column) != {"origin", "label", "pinned", "shown"}:
                raise InputError(f"state: a column with {', '.join(column)}; expected origin, label, pinned, shown")
            if not isinstance(column["pinned"], dict | None) or not isinstance(column["origin"], str):
                raise InputError(f"state: column {column['label']}: expected a name and parameters by name")
        if state.shape is not None and set(state.shape) != {"origin", "region", "place"}:
            raise InputError("state: a shape; expected its origin, region and place")
        if all(column["pinned"] is not None for column in state.columns):
            raise InputError("state: no model under the sliders")
        return state
    except InputError:
        raise
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise InputError(f"state: not a file that ODeform saved: {error}") from None
