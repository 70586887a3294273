"""How each column was computed, and how large its errors are."""

import math

import numpy as np

from odeform.motion.base import Motion
from odeform_viz.page import Page, Panel
from odeform_viz.panels.callbacks import set_content
from odeform_viz.view import ColumnFrame, Description

__all__ = ["StatusPanel", "describe_column"]


def describe_column(shown: ColumnFrame, time: float, settled: bool = True) -> str:
    """Markdown: solver, work, solver error and model error of one column at `time` in seconds.

    The solver error costs as much as the solution, so it is left open until the view has `settled`.
    """
    column, stats = shown.column, shown.stats
    lines = [f"**{column.label}** · {len(column.geometry.points):,} points"]
    if column.predictor is None:
        return "  \n".join([*lines, stats.solver, "cubic interpolation between frames"])
    if stats.evaluations:
        error = "…" if not settled else "unknown"
        if settled and stats.solver_error_mm is not None:
            error = f"{stats.solver_error_mm:.2g} mm"
        lines.append(f"{stats.solver} · {stats.evaluations} evaluations · {stats.wall_ms:.1f} ms")
        lines.append(f"solver error ≈ {error} (estimated)")
    else:
        lines.append(f"{stats.solver} · no ODE · {stats.wall_ms:.1f} ms")
    if shown.error is not None:
        e = shown.error
        lines.append(f"error now: RMSE {e.rmse_mm:.2f}, MAE {e.mae_mm:.2f}, max {e.worst_mm:.2f} mm")
    band = column.predictor.error_band(shown.motion.parameters, np.array([time]))
    if band is not None:
        median, most = band[0]
        rough = " (extrapolated: rough)" if shown.motion.extrapolates(time) or shown.motion.outside else ""
        lines.append(f"model error here ≈ {median:.2f} mm, 90 % below {most:.2f} mm{rough}")
    score = column.predictor.checkpoint.scores.get("rmse_pooled_mm")
    if score is not None:
        lines.append(f"test error of the checkpoint: RMSE {score:.2f} mm")
    if stats.status != "ok" and isinstance(shown.motion, Motion):
        last = shown.motion.last_good
        later = f": showing the last good state, t = {last:.3f} s" if math.isfinite(last) else ""
        lines.append(f"⚠ **{stats.status}**{later}")
    return "  \n".join(lines)


class StatusPanel(Panel):
    """One paragraph per column."""

    def __init__(self, page: Page) -> None:
        with page.server.gui.add_folder("Status"):
            self._text = page.server.gui.add_markdown("")

    def describe(self, description: Description) -> None:
        frame = description.frame
        columns = (describe_column(c, frame.request.time, description.settled) for c in frame.columns)
        set_content(self._text, "\n\n".join(columns))
