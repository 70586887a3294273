"""The layout in which Rerun opens a recording."""

from collections.abc import Iterable

import rerun.blueprint as rrb

from odeform_viz.recording.entities import FRAME, PROVENANCE, REQUEST, STILL, WORLD
from odeform_viz.recording.logged_column import PLOTS, LoggedColumn

__all__ = ["make_blueprint"]


def make_blueprint(columns: Iterable[LoggedColumn]) -> rrb.Blueprint:
    """A 3D view for each column, and plots below."""
    columns = list(columns)
    spaces = [
        rrb.Spatial3DView(
            origin=WORLD, contents=[f"{WORLD}/column_{c.column.key}/**", f"{STILL}/**"], name=c.column.label
        )
        for c in columns
    ]
    plots = {
        view: [rrb.TimeSeriesView(origin=f"{view}/{quantity}", name=quantity) for quantity in quantities]
        for view, quantities in PLOTS.items()
    }
    provenance = [
        rrb.TextDocumentView(origin=f"{PROVENANCE}/{c.name}", name=f"provenance: {c.column.label}") for c in columns
    ]
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(*spaces),
            rrb.Horizontal(
                rrb.TimeSeriesView(origin="parameters", name="parameters"),
                *plots["curves"],
                rrb.Tabs(*plots["errors"]),
                rrb.Tabs(
                    *plots["statistics"],
                    rrb.TextLogView(origin="status", name="status"),
                    rrb.TextDocumentView(origin=REQUEST, name="request"),
                    *provenance,
                ),
            ),
            row_shares=[3, 2],
        ),
        rrb.TimePanel(timeline=FRAME, state="collapsed"),
        collapse_panels=True,
    )
