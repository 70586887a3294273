"""How each column was computed, and how large its errors are."""

import math
from collections.abc import Sequence
from html import escape
from time import monotonic

import numpy as np

from odeform.loads.registry import load_of_scene
from odeform.models.base import Predictor
from odeform.models.error_band import FEWEST
from odeform.motion.base import Motion, SolveStats
from odeform.motion.rest import rests_from
from odeform.motion.truth_errors import DISTANCE
from odeform.schema import Window
from odeform_viz.page import Page, Panel
from odeform_viz.panels.callbacks import set_content
from odeform_viz.view import ColumnFrame, Description, played_until, same_motions, shown_until
from odeform_viz.words import rounded

__all__ = ["StatusPanel", "describe_column", "status_html"]

PAUSE = 1.0  # s between tables while it plays: they are read slowly, and larger than all else that is sent
STYLE = """<style>
.odeform-status{width:100%;border-spacing:0;font:12px/1.4 sans-serif;color:var(--mantine-color-text);padding:0 0.6em}
.odeform-status th{text-align:left;padding:0.5em 0 0.2em}
.odeform-status td{vertical-align:top;padding:1px 0;border-top:1px solid #8883}
.odeform-status td:first-child:not([colspan]){opacity:0.7;width:38%;padding-right:0.6em}
</style>"""


def describe_column(shown: ColumnFrame, time: float, settled: bool = True) -> str:
    """Markdown: solver, work, solver error and model error of one column at `time` in seconds.

    The solver error, and whether the motion stops later and when the body rests, take longer than the motion: they
    follow when the view has `settled`.
    """
    column, stats = shown.column, shown.stats
    lines = [f"**{column.label}** · {len(column.geometry.points):,} points"]
    if column.predictor is None:
        return "  \n".join([*lines, stats.solver, "cubic interpolation between frames"])
    if stats.evaluations:
        lines.append(
            f"computed: {stats.evaluations} evaluations of the model in {rounded(stats.wall_ms)} ms by {stats.solver}"
        )
        lines.append(_solver_error(stats, shown.motion.schema.window) if settled else "solver error: …")
    else:
        lines.append(f"{stats.solver}, no ODE to solve · {rounded(stats.wall_ms)} ms")
    if shown.error is not None:
        e = shown.error
        values = f"RMS {e.rms_mm:.2f}, mean {e.mean_mm:.2f}, largest {e.worst_mm:.2f} mm"
        lines.append(f"error now: {values} (distance from the truth)")
    lines += _model_error(shown, column.predictor, time)
    if isinstance(shown.motion, Motion):
        lines += _stops(shown.motion, time, settled)
        lines += _rest(shown.motion, settled)
    return "  \n".join(lines)


def _solver_error(stats: SolveStats, window: Window) -> str:
    if stats.solver_error_mm is None:
        return "solver error: unknown"
    return f"solver error: RMS {stats.solver_error_mm:.2g} mm until {window.stop:g} s, against a finer solution"


def _model_error(shown: ColumnFrame, predictor: Predictor, time: float) -> list[str]:
    only = shown.motion.only_at if isinstance(shown.motion, Motion) else None
    if only is not None and abs(time - only) > 1e-6:
        return [f"⚠ **only t = {only:.3g} s is predicted**: that state is shown, not this moment's"]
    if shown.untrained and not predictor.knows_untrained_errors:
        return ["error expected: not known, this shape was not trained"]
    band = shown.error_band(np.array([time]))
    if band is None and load_of_scene(shown.motion.schema.scene) is not None:
        return ["error expected here: not known for motions of this kind"]
    if band is None and shown.changed:
        lines = ["error expected here: not known, no data have this mass or stiffness"]
    elif band is None:
        lines = [f"error expected here: not known, with fewer than {FEWEST} validation sequences"]
    else:
        rough = " (extrapolated: rough)" if shown.motion.extrapolates(time) or shown.motion.outside else ""
        lines = [f"error expected here: half below {band[0, 0]:.2f} mm, 90 % below {band[0, 1]:.2f} mm{rough}"]
        lines += _calibrated(shown, predictor)
    if shown.untrained:
        return [*lines, "as measured on other shapes that were not trained"]
    score = predictor.checkpoint.scores.get("rmse_pooled_mm")
    return lines if score is None else [*lines, f"error on the test sequences: RMS {DISTANCE * score:.2f} mm"]


def _calibrated(shown: ColumnFrame, predictor: Predictor) -> list[str]:
    """Says what the expected error was measured on."""
    motions = 0 if shown.untrained else predictor.band_motions(shown.motion.parameters)
    if not motions:
        return ["measured on: moments of motions, one by one"]
    return [f"measured on: {motions} motions that nothing was fitted to; 9 of 10 stay below it from beginning to end"]


def _stops(motion: Motion, time: float, settled: bool) -> list[str]:
    """Says what is wrong with the solution, and from where on the motion is not physically possible."""
    status, lines = motion.stats.status, []
    if status != "ok":
        last = motion.last_good
        later = f": showing the last good state, t = {last:.3f} s" if math.isfinite(last) else ""
        lines.append(f"⚠ **{status}**{later}")
    stop = motion.stop_at(time) or (motion.first_stop(shown_until(motion.schema.window)) if settled else None)
    return lines if stop is None else [*lines, f"⚠ {stop}"]


def _rest(motion: Motion, settled: bool) -> list[str]:
    """Says when the body has come to rest, of motions that are played until then."""
    window = motion.schema.window
    if not settled or (until := played_until(window)) <= window.stop or motion.stats.status != "ok":
        return []
    begin = rests_from(motion, until)
    return [f"still moves at {until:.2g} s" if begin is None else f"at rest from t = {begin:.2f} s on"]


def status_html(texts: Sequence[str]) -> str:
    """A table: a heading for each text of `describe_column`, and below it what is said, by what it is of."""
    return f'<table class="odeform-status">{"".join(map(_rows, texts))}</table>'


def _rows(text: str) -> str:
    title, *lines = (escape(line).replace("**", "") for line in text.split("  \n"))
    rows = [f'<tr><th colspan="2">{title}</th></tr>']
    for line in lines:
        of, colon, what = line.partition(": ")
        rows.append(f"<tr><td>{of}: </td><td>{what}</td></tr>" if colon else f'<tr><td colspan="2">{line}</td></tr>')
    return "".join(rows)


class StatusPanel(Panel):
    """A table with a part for each column; while it plays, it follows once a second."""

    def __init__(self, page: Page) -> None:
        with page.server.gui.add_folder("Status"):
            page.server.gui.add_html(STYLE)  # once: the table changes several times a second
            self._text = page.server.gui.add_html("")
        self._clock = page.clock
        self._shown: Description | None = None
        self._due = 0.0

    def describe(self, description: Description) -> None:
        frame, shown = description.frame, self._shown
        same = shown is not None and shown.settled == description.settled and same_motions(frame, shown.frame)
        if same and self._clock.playing and monotonic() < self._due:
            return
        self._shown, self._due = description, monotonic() + PAUSE
        columns = [describe_column(c, frame.request.time, description.settled) for c in frame.columns]
        set_content(self._text, status_html(columns))
