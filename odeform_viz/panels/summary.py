"""Always visible: how far the current frame can be trusted, why a request cannot be met, and the error colours."""

from odeform_viz.page import Page, Panel
from odeform_viz.panels.callbacks import set_content
from odeform_viz.rendering.error_colors import BANDS
from odeform_viz.view import Description, Frame

__all__ = ["SummaryPanel", "summarize"]

OFF_TRUTH = "The truth was simulated with other parameters, so no errors are shown."
ON_FRAME = 0.02  # frames; closer times count as on the frame


def summarize(frame: Frame) -> str:
    """Markdown: inside the trained range or extrapolated, below the floor, still to be computed, or refused."""
    lines = [_trust(frame)]
    if low := [c.column.label for c in frame.columns if c.below_floor]:
        deepest = max(c.depth for c in frame.columns)
        lines.append(f"⚠ **{', '.join(low)}**: {1e3 * deepest:.0f} mm below the floor")
    lines += [f"… **{label}** is being computed" for label in frame.pending]
    return "  \n".join([*lines, *(f"⚠ **{reason}**" for reason in frame.refused)])


def _trust(frame: Frame) -> str:
    models = [c for c in frame.columns if c.column.predictor]
    if not models:
        return "only the truth is visible" if frame.columns else "no column is visible"
    motion, time = models[0].motion, frame.request.time
    outside = list(dict.fromkeys(name for c in models for name in c.motion.outside))
    if motion.extrapolates(time):
        outside.insert(0, "time")
    if outside:
        return f"⚠ **extrapolated**: {', '.join(outside)} outside the trained range"
    window = motion.schema.window
    phase = (time - window.start) * window.rate
    on_frame = abs(phase - round(phase)) < ON_FRAME
    return f"inside the trained range ({'on a trained frame' if on_frame else 'between frames'})"


def _scale_html(top: float) -> str:
    """The colour bar of errors up to `top` mm."""
    bands = "".join(f'<div style="flex:1;height:10px;background:rgb{color}"></div>' for color in BANDS)
    return (
        f'<div style="padding:0 1em 0.6em;font-size:0.8em;display:flex;align-items:center;gap:0.4em">'
        f'<span>0</span><div style="flex:1;display:flex">{bands}</div><span>≥ {top:g} mm from the truth</span></div>'
    )


class SummaryPanel(Panel):
    """A few lines of text and the colour bar; sent only when they change."""

    def __init__(self, page: Page) -> None:
        self._text = page.server.gui.add_markdown("")
        self._scale = page.server.gui.add_html("", visible=False)

    def describe(self, description: Description) -> None:
        frame, top = description.frame, description.error_scale
        set_content(self._text, summarize(frame) + (f"  \n{OFF_TRUTH}" if frame.off_truth else ""))
        visible = top is not None and any(column.error for column in frame.columns)
        if visible and top is not None:
            set_content(self._scale, _scale_html(top))
        self._scale.visible = visible

    def show_error(self, message: str) -> None:
        set_content(self._text, f"⚠ **{message}**")
