"""Always visible: how far the current frame can be trusted, and why a request cannot be met."""

from odeform_viz.page import Page, Panel
from odeform_viz.panels.callbacks import set_content
from odeform_viz.pushing import describe_push, first_push, outside_of_push
from odeform_viz.view import Description, Frame

__all__ = ["SummaryPanel", "summarize"]

OFF_TRUTH = "The truth was simulated with other parameters, so no errors are shown."
UNKNOWN = "Not known of the truth: {}. Errors are those of the model and of the sliders together."
ON_FRAME = 0.02  # frames; closer times count as on the frame


def summarize(frame: Frame) -> str:
    """Markdown: inside the trained range or extrapolated, stopped, below the floor, to be computed, or refused."""
    lines = [*_push(frame), _validity(frame)]
    for column in frame.columns:
        if stop := column.stop_at(frame.request.time):
            lines.append(f"⚠ **{column.column.label}** {stop}")
    if low := [c.column.label for c in frame.columns if c.below_floor]:
        deepest = max(c.depth for c in frame.columns)
        lines.append(f"⚠ **{', '.join(low)}**: {1e3 * deepest:.0f} mm below the floor")
    lines += [f"… **{label}** is being computed" for label in frame.pending]
    return "  \n".join([*lines, *(f"⚠ **{reason}**" for reason in frame.refused)])


def _push(frame: Frame) -> list[str]:
    """Says what pushes which body, where a sphere does."""
    found = first_push(frame)
    return [] if found is None else [describe_push(*found)]


def _validity(frame: Frame) -> str:
    models = [c for c in frame.columns if c.column.predictor]
    if not models:
        return "only the truth is visible" if frame.columns else "no column is visible"
    motion, time = models[0].motion, frame.request.time
    outside = list(dict.fromkeys([*(name for c in models for name in c.motion.outside), *outside_of_push(frame)]))
    if motion.extrapolates(time):
        outside.insert(0, "time")
    untrained = "⚠ **shape not trained**; " if any(c.untrained for c in models) else ""
    if outside:
        return f"{untrained or '⚠ '}**extrapolated**: {', '.join(outside)} outside the trained range"
    if untrained:
        return f"{untrained}parameters and time inside the trained range"
    window = motion.schema.window
    phase = (time - window.start) * window.rate
    on_frame = abs(phase - round(phase)) < ON_FRAME
    return f"inside the trained range ({'on a trained frame' if on_frame else 'between frames'})"


class SummaryPanel(Panel):
    """A few lines of text; sent only when they change."""

    def __init__(self, page: Page) -> None:
        self._text = page.server.gui.add_markdown("")

    def describe(self, description: Description) -> None:
        frame = description.frame
        truth = frame.truth.column.truth if frame.truth else None
        lines = [summarize(frame)]
        if frame.off_truth:
            lines.append(OFF_TRUTH)
        elif truth is not None and truth.unknown:
            lines.append(UNKNOWN.format(", ".join(truth.unknown)))
        set_content(self._text, "  \n".join(lines))

    def show_error(self, message: str) -> None:
        set_content(self._text, f"⚠ **{message}**")
