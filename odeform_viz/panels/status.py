"""What is shown, how it was computed, and how far it may be trusted."""

import math

import numpy as np
import viser

from odeform.motion.base import Motion
from odeform_viz.rendering.error_colors import BANDS
from odeform_viz.view import ColumnFrame, Frame

__all__ = ["MomentPanel", "StatusPanel", "describe", "moment_in_words"]


def moment_in_words(frame: Frame) -> str:
    """Where the moment lies, and what is wrong: below the floor, or not to be shown."""
    words = [_place_in_time(frame)]
    if sunk := [shown.column.label for shown in frame.columns if shown.below_floor]:
        deepest = max(shown.depth for shown in frame.columns)
        words.append(f"⚠ **{', '.join(sunk)}**: {1e3 * deepest:.0f} mm below the floor")
    words += [f"… **{label}** is being computed" for label in frame.pending]
    return "  \n".join([*words, *(f"⚠ **{reason}**" for reason in frame.refused)])


def _place_in_time(frame: Frame) -> str:
    """On a trained frame, between two, or beyond; and parameters outside of what was trained."""
    models = [shown for shown in frame.columns if shown.column.predictor]
    if not models:
        return "the truth alone" if frame.columns else "nothing shown"
    motion, time = models[0].motion, frame.request.time
    beyond = list(dict.fromkeys(name for shown in models for name in shown.motion.outside))
    if motion.extrapolates(time):
        beyond.insert(0, "time")
    if beyond:
        return f"⚠ **extrapolated**: {', '.join(beyond)} beyond what was trained"
    window = motion.schema.window
    phase = (time - window.start) * window.rate
    return "as trained, " + ("on a trained frame" if abs(phase - round(phase)) < 0.02 else "between two frames")


def describe(shown: ColumnFrame, time: float, settled: bool = True) -> str:
    """Solver, work, solver error and model error of one column at `time`, as Markdown.

    The solver error costs as much as the solution: it is left open until the user's hand has `settled`.
    """
    column, stats = shown.column, shown.stats
    lines = [f"**{column.label}** · {len(column.geometry.points):,} points"]
    if column.predictor is None:
        return "  \n".join([*lines, stats.solver, "between its frames cubic"])
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
        lines.append(f"now off the truth by {e.rmse_mm:.2f} mm RMSE, {e.mae_mm:.2f} MAE, {e.worst_mm:.2f} at worst")
    expected = column.predictor.error_band(shown.motion.parameters, np.array([time]))
    if expected is not None:
        half, most = expected[0]
        beyond = shown.motion.extrapolates(time) or shown.motion.outside
        lines.append(f"model error here ≈ {half:.2f} mm, 9 in 10 below {most:.2f}{' ⚠ a guess' if beyond else ''}")
    score = column.predictor.checkpoint.scores.get("rmse_pooled_mm")
    if score is not None:
        lines.append(f"test error of the checkpoint {score:.2f} mm RMSE")
    if stats.status != "ok" and isinstance(shown.motion, Motion):
        last = shown.motion.last_good
        later = f": showing the last good state, t = {last:.3f} s" if math.isfinite(last) else ""
        lines.append(f"⚠ **{stats.status}**{later}")
    return "  \n".join(lines)


def scale_html(top: float) -> str:
    """The colour bar of errors, in mm."""
    bands = "".join(f'<div style="flex:1;height:10px;background:rgb{color}"></div>' for color in BANDS)
    cells = f'<div style="flex:1;display:flex">{bands}</div>'
    return (
        f'<div style="padding:0 1em 0.6em;font-size:0.8em;display:flex;align-items:center;gap:0.4em">'
        f"<span>0</span>{cells}<span>≥ {top:g} mm from the truth</span></div>"
    )


class MomentPanel:
    """Always in sight: where the moment lies, why a request cannot be met, the colours' scale. Sent only on change."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._moment = server.gui.add_markdown("")
        self._scale = server.gui.add_html("", visible=False)

    def show(self, frame: Frame, heat: float | None, away: bool) -> None:
        """`heat` is the top of the colour scale, where errors are painted; `away`, that the sliders left the truth."""
        note = "  \nThe truth is of other parameters than the sliders: no errors shown." if away else ""
        _say(self._moment, moment_in_words(frame) + note)
        painted = heat is not None and any(shown.error for shown in frame.columns)
        if painted and heat is not None:
            _say(self._scale, scale_html(heat))
        self._scale.visible = painted

    def show_error(self, message: str) -> None:
        """The last good frame stays on screen."""
        _say(self._moment, f"⚠ **{message}**")


class StatusPanel:
    """A paragraph a column."""

    def __init__(self, server: viser.ViserServer) -> None:
        with server.gui.add_folder("Status"):
            self._details = server.gui.add_markdown("")

    def show(self, frame: Frame, settled: bool) -> None:
        _say(self._details, "\n\n".join(describe(shown, frame.request.time, settled) for shown in frame.columns))


def _say(text: viser.GuiMarkdownHandle | viser.GuiHtmlHandle, content: str) -> None:
    if text.content != content:
        text.content = content
