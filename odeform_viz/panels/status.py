"""What is shown, how it was computed, and how far it may be trusted."""

import viser

from odeform_viz.session import Column, ColumnFrame, Frame

__all__ = ["StatusPanel", "describe", "moment_in_words"]


def moment_in_words(frame: Frame) -> str:
    """Trained, or what is extrapolated: time and parameters."""
    shown = next((column for column in frame.columns if column is not None), None)
    if shown is None:
        return "nothing shown"
    beyond = list(shown.motion.outside)
    if shown.motion.extrapolates(frame.wish.time):
        beyond.insert(0, "time")
    return f"⚠ **extrapolated**: {', '.join(beyond)} beyond what was trained" if beyond else "inside what was trained"


def describe(column: Column, frame: ColumnFrame, settled: bool = True) -> str:
    """Solver, work, solver error and the checkpoint's test error of one column, as Markdown.

    The solver error costs as much as the solution: it is left open until the user's hand has `settled`.
    """
    stats = frame.stats
    lines = [f"**{column.label}** · {len(column.geometry.points):,} points"]
    if stats.evaluations:
        error = "…" if not settled else "unknown"
        if settled and stats.solver_error_mm is not None:
            error = f"{stats.solver_error_mm:.2g} mm"
        lines.append(f"{stats.solver} · {stats.evaluations} evaluations · {stats.wall_ms:.1f} ms")
        lines.append(f"solver error ≈ {error} (estimated)")
    else:
        lines.append(f"{stats.solver} · no ODE · {stats.wall_ms:.1f} ms")
    score = column.predictor.checkpoint.scores.get("rmse_pooled_mm")
    if score is not None:
        lines.append(f"test error of the checkpoint {score:.2f} mm RMSE")
    if stats.status != "ok":
        lines.append(
            f"⚠ **{stats.status}**: showing the last good state, t = {frame.motion.trajectory.last_good:.3f} s"
        )
    return "  \n".join(lines)


class StatusPanel:
    """Two texts, sent only when they change."""

    def __init__(self, server: viser.ViserServer, columns: tuple[Column, ...]) -> None:
        self._columns = columns
        with server.gui.add_folder("Status"):
            self._moment = server.gui.add_markdown("")
            self._details = server.gui.add_markdown("")

    def show(self, frame: Frame, settled: bool) -> None:
        shown = zip(self._columns, frame.columns, strict=True)
        _say(self._moment, moment_in_words(frame))
        _say(self._details, "\n\n".join(describe(column, one, settled) for column, one in shown if one is not None))

    def show_error(self, message: str) -> None:
        """The last good frame stays on screen."""
        _say(self._moment, f"⚠ **{message}**")


def _say(text: viser.GuiMarkdownHandle, content: str) -> None:
    if text.content != content:
        text.content = content
