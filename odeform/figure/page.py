"""Writes columns as one page of HTML, which needs nothing else."""

import base64
import json
import math
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from string import Template
from typing import Any

import numpy as np

from odeform.errors import InputError
from odeform.figure.grid import FigureColumn
from odeform.figure.splats import FigureSplats
from odeform.figure.sweep import Sweep
from odeform.figure.truth import truth_error
from odeform.loads.registry import known_as
from odeform.models.titles import subject_of
from odeform.motion.caveats import caveats
from odeform.motion.recorded import RecordedMotion
from odeform.schema import OBJECT
from odeform.types import Arrays

__all__ = ["MOST_BYTES", "MOST_COLUMNS", "column_bytes", "figure_page"]

MOST_BYTES = 5_000_000
MOST_COLUMNS = 4
SCRIPTS = (
    "data.js",
    "column.js",
    "shaders.js",
    "splat_shaders.js",
    "webgl.js",
    "splats.js",
    "splat_drawing.js",
    "drawing.js",
    "camera.js",
    "controls.js",
    "pointer.js",
    "page.js",
)
BESIDE = 80_000  # bytes of the page without its arrays


def column_bytes(columns: int) -> int:
    """How many bytes each of so many columns may take in a page of at most `MOST_BYTES`."""
    return (MOST_BYTES - BESIDE) // columns


def figure_page(columns: Sequence[FigureColumn], truth: RecordedMotion | None = None) -> bytes:
    """The page of one to four columns of one scene, with a slider for each parameter that any of them sweeps.

    With a `truth`, it shows the error of each model against it where the sliders have its parameters.

    Raises `InputError` where there is none.
    """
    sweeps = list({sweep.name: sweep for column in columns for sweep in column.source.sweeps}.values())
    if not sweeps:
        raise InputError("figure: expected a model that is not pinned at parameters of its own")
    schema = columns[0].source.predictor.schema
    body = columns[0].source.complete(np.full(len(columns[0].source.sweeps), 0.5)).get(OBJECT, "")
    subject = subject_of(schema.scene, str(body))
    title = f"{subject} · {columns[0].label}" if len(columns) == 1 else subject
    page = (files("odeform.figure") / "figure.html").read_text(encoding="utf-8")
    script = "".join((files("odeform.figure") / "script" / name).read_text(encoding="utf-8") for name in SCRIPTS)
    data = json.dumps(_data(columns, sweeps, truth), ensure_ascii=True).replace("<", "\\u003c")
    subtitle, notes = (
        escape(_subtitle(columns, sweeps)),
        "".join(f"<p>{escape(note)}</p>" for note in _notes(columns, sweeps)),
    )
    filled = Template(page).substitute(title=escape(title), subtitle=subtitle, notes=notes, data=data, script=script)
    return filled.encode()


def _data(columns: Sequence[FigureColumn], sweeps: Sequence[Sweep], truth: RecordedMotion | None) -> dict[str, Any]:
    first, around = columns[0], columns[0].source.predictor.surroundings
    names = [sweep.name for sweep in sweeps]
    return {
        "sweeps": [_slider(sweep) for sweep in sweeps],
        "start": float(first.times[0]),
        "step": float(first.times[1] - first.times[0]),
        "frames": len(first.times),
        "size": max(_size(column) for column in columns),
        "floor": None if around is None else around.floor,
        "low": _low(first),
        "cell": _cell(columns),
        "known": known_as(first.source.predictor.schema.scene),
        "columns": [
            {
                "label": column.label,
                "counts": column.table.counts,
                "axes": [names.index(sweep.name) for sweep in column.source.sweeps],
                "azimuth": column.body.azimuth,
                "truth": _compared(column, truth),
                "arrays": _encoded({**column.body.arrays(), **column.table.arrays()}),
            }
            for column in columns
        ],
    }


def _compared(column: FigureColumn, truth: RecordedMotion | None) -> dict[str, Any] | None:
    found = None if truth is None else truth_error(column, truth)
    if found is None:
        return None
    errors = [round(error, 4) if math.isfinite(error) else None for error in found.rms_mm.tolist()]
    return {"places": found.places.tolist(), "rms_mm": errors}


def _slider(sweep: Sweep) -> dict[str, Any]:
    parameter = sweep.parameter
    return {
        "name": sweep.name,
        "unit": parameter.unit,
        "low": sweep.low,
        "high": sweep.high,
        "log": sweep.logarithmic,
        "place": sweep.place(parameter.default) if sweep.low < parameter.default < sweep.high else 0.5,
        "trained": [parameter.low, parameter.high],
    }


def _encoded(arrays: Arrays) -> dict[str, dict[str, Any]]:
    """Little-endian bytes in base64, with their type and shape."""
    return {
        name: {
            "dtype": array.dtype.name,
            "shape": array.shape,
            "data": base64.b64encode(
                np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("<")).tobytes()
            ).decode(),
        }
        for name, array in arrays.items()
    }


def _size(column: FigureColumn) -> float:
    return float(np.ptp(column.body.rest, axis=0).max())


def _low(column: FigureColumn) -> float:
    """Height in metres of the middle of the body when it touches the floor; where it rests, without one."""
    around, heights = column.source.predictor.surroundings, column.body.rest[:, 2]
    if around is None or around.floor is None:
        return float(column.body.anchor[2])
    return around.floor - float(heights.min())


def _cell(columns: Sequence[FigureColumn]) -> float:
    """The spacing of the floor's grid in metres: a power of ten."""
    return 10.0 ** round(math.log10(0.4 * max(_size(column) for column in columns)))


def _subtitle(columns: Sequence[FigureColumn], sweeps: Sequence[Sweep]) -> str:
    """What does not move: parameters without a slider that were given."""
    first, swept = columns[0].source, {sweep.name for sweep in sweeps}
    units = {p.name: p.unit for p in first.predictor.schema.parameters}
    given = [
        f"{name} {float(value):.4g} {units[name]}".strip()
        for name, value in first.predictor.schema.expanded(first.fixed).items()
        if name in units and name not in swept
    ]
    if any(column.body.splats and column.body.splats.still for column in columns):
        return ", ".join(given)  # they have a floor of their own
    cell = _cell(columns)
    grid = f"grid {100 * cell:g} cm" if cell < 1.0 else f"grid {cell:g} m"
    return ", ".join([*given, grid])


def _notes(columns: Sequence[FigureColumn], sweeps: Sequence[Sweep]) -> list[str]:
    notes = [_column_note(column, len(columns) > 1) for column in columns]
    notes += dict.fromkeys(_splat_note(column.body.splats) for column in columns if column.body.splats)
    outside = [s.name for s in sweeps if not (s.parameter.inside(s.low) and s.parameter.inside(s.high))]
    if outside:
        known = known_as(columns[0].source.predictor.schema.scene)
        notes.append(f"* {', '.join(outside)}: partly outside of what was {known}.")
    # of a shape that was not trained, and of times after the window
    notes += dict.fromkeys(f"{note}." for c in columns for note in caveats(c.source.middle, c.times))
    return notes


def _column_note(column: FigureColumn, several: bool) -> str:
    """How far the figure is from its model, and the model from what it was trained on."""
    who, error, tolerance = f"{column.label}: " if several else "", column.error, column.tolerance_mm
    if column.table.counts:
        grid = " × ".join(str(count) for count in column.table.counts)
        shown = (
            f"{who}{'i' if several else 'I'}nterpolated between {grid} motions. At other parameters and times, half of "
            f"the motions are within {error.half:.2g} mm of the model and 90 % within {error.most:.2g} mm; "
            f"{error.rms:.2g} mm together (RMS distance of the points)."
        )
    else:
        shown = f"{who}one motion, at any time within {error.rms:.2g} mm of the model (RMS distance of the points)."
    if column.band_mm is None:
        band = "The error of the model itself is not known."
    else:
        half, most = column.band_mm
        band = (
            f"Of unseen motions, half are within {half:.2g} mm of what the model says, and 90 % within {most:.2g} mm."
        )
    aim = f" This is more than the {tolerance[0]:.2g} and {tolerance[1]:.2g} mm aimed at, as fine as it gets."
    return f"{shown}{'' if column.fine else aim} {band}"


def _splat_note(splats: FigureSplats) -> str:
    """How many splats are shown, with how much of their colours, and how far from the model's."""
    (shown, every), (moving, still) = splats.shown, splats.degrees
    rms, worst = splats.apart_mm
    count = f"{shown:,} splats" if shown == every else f"{shown:,} of {every:,} splats, larger than they are,"
    said = (
        f"{count}; centres that move are carried by {len(splats.binding.nodes)} of them, within {rms:.2g} mm (RMS) "
        f"and {worst:.2g} mm at most of where the model has them."
    )
    given = splats.given_degree
    if given == 0:
        return f"{said} Their colours do not depend on the view."
    other = f", of what stands still {still}" if splats.still is not None and still != moving else ""
    kept = f"harmonics up to degree {moving}{other} (of {given} in the file)"
    return f"{said} Their colours depend on the view, by {kept}."
