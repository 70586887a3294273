"""The layout in which Rerun opens a recording."""

from collections.abc import Iterable

import numpy as np
import rerun.blueprint as rrb

from odeform.schema import Schema
from odeform_viz.recording.entities import FLOOR, FRAME, PROVENANCE, REQUEST, STILL, WORLD
from odeform_viz.recording.logged_column import PLOTS, LoggedColumn

__all__ = ["make_blueprint"]

BACKGROUND = (250, 250, 252)
EYE = np.array([-2.2, -1.5, 1.1])  # sizes of the body, from its centre


def make_blueprint(columns: Iterable[LoggedColumn]) -> rrb.Blueprint:
    """Makes a 3D view for each column, and plots below, one per unit."""
    columns = list(columns)
    spaces = [_space(logged) for logged in columns]
    results = [_plot(unit, [f"{quantity}/**" for quantity in quantities]) for unit, quantities in PLOTS.items()]
    provenance = [
        rrb.TextDocumentView(origin=f"{PROVENANCE}/{c.name}", name=f"provenance: {c.column.label}") for c in columns
    ]
    texts = rrb.Tabs(
        rrb.TextLogView(origin="status", name="status"),
        rrb.TextDocumentView(origin=REQUEST, name="request"),
        *provenance,
    )
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(*spaces),
            rrb.Horizontal(*results),
            rrb.Horizontal(*_parameter_plots(columns[0].column.source.schema), texts),
            row_shares=[4, 2, 2],
        ),
        rrb.TimePanel(timeline=FRAME, state="collapsed"),
        collapse_panels=True,
    )


def _space(logged: LoggedColumn) -> rrb.Spatial3DView:
    contents = [f"{WORLD}/column_{logged.column.key}/**", f"{STILL}/**", f"{FLOOR}/**"]
    points = np.asarray(logged.column.geometry.points, dtype=float)
    centre, size = points.mean(axis=0), float(np.ptp(points, axis=0).max())
    return rrb.Spatial3DView(
        origin=WORLD,
        contents=contents,
        name=logged.column.label,
        background=BACKGROUND,
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(
            position=centre + size * EYE, look_target=centre, tracking_entity=f"{WORLD}/{logged.name}/body"
        ),
    )


def _parameter_plots(schema: Schema) -> list[rrb.TimeSeriesView]:
    units: dict[str, list[str]] = {}
    for parameter in schema.parameters:
        units.setdefault(parameter.unit, []).append(parameter.name)
    return [_plot(f"{', '.join(names)}: {unit}", [f"parameters/{n}" for n in names]) for unit, names in units.items()]


def _plot(name: str, contents: list[str]) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(origin="/", contents=contents, name=name)
