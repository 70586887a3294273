"""How far the current frame can be trusted, what acts, and why a request cannot be met; always in view."""

from dataclasses import dataclass
from html import escape

import numpy as np

from odeform.loads.registry import CLAMPED, load_of_scene
from odeform.motion.base import Motion
from odeform_viz.page import Page, Panel
from odeform_viz.panels.callbacks import set_content
from odeform_viz.panels.in_view import in_view
from odeform_viz.pushing import describe_push, first_push, outside_of_push
from odeform_viz.view import ColumnFrame, Description, Frame
from odeform_viz.words import known_range

__all__ = ["Badge", "SummaryPanel", "badge_of", "summarize"]

OFF_TRUTH = "The truth was simulated with other parameters, so no errors are shown."
UNKNOWN = "Not known of the truth: {}. Errors are those of the model and of the sliders together."


@dataclass(frozen=True)
class Badge:
    """How far a frame can be trusted: "inside" what was trained, "outside" of it, or "unknown"; and why, in words."""

    level: str
    text: str
    expected: str = ""
    """The error that is expected; empty where no model is in view."""

    @property
    def html(self) -> str:
        """The text in the colour of its level, with the expected error."""
        return f'<span class="odeform-badge {self.level}">{escape(self.text)}</span> {escape(self.expected)}'


def badge_of(frame: Frame) -> Badge:
    """The least that holds for all models in view."""
    models = [c for c in frame.columns if c.column.predictor]
    if not models:
        return Badge("unknown", "only the truth is in view" if frame.columns else "no column is in view")
    expected = _expected(models[0], alone=len(models) == 1)
    for shown in models:
        if stop := shown.stop_at(frame.request.time):
            return Badge("unknown", f"not modelled: {stop}")
        only = shown.motion.only_at if isinstance(shown.motion, Motion) else None
        if only is not None and abs(frame.request.time - only) > 1e-6:
            return Badge("unknown", f"not modelled: only t = {only:.3g} s is predicted, and shown")
    schema = models[0].motion.schema
    outside = list(dict.fromkeys([*(name for c in models for name in c.motion.outside), *outside_of_push(frame)]))
    if models[0].motion.extrapolates(frame.request.time):
        outside.insert(0, "time")
    where = f"extrapolated: {', '.join(outside)} outside the {known_range(schema)}" if outside else ""
    if untrained := [c for c in models if c.untrained]:
        known = all(c.column.predictor and c.column.predictor.knows_untrained_errors for c in untrained)
        text = "; ".join(filter(None, ("shape not trained", where)))
        return Badge("outside" if known else "unknown", text, expected)
    if load_of_scene(schema.scene) is not None:
        # amber: what moves it is modelled, and no data say how well under this load
        text = "; ".join(filter(None, ("mechanics: only its contacts were fitted", where)))
        return Badge("outside", text, expected)
    if schema.scene == CLAMPED:
        return Badge("outside", "; ".join(filter(None, ("mechanics: nothing of it is learned", where))), expected)
    if any(c.changed for c in models):
        where = "; ".join(filter(None, ("no data have this mass or stiffness", where)))
        return Badge("unknown", where, expected)
    return Badge("outside", where, expected) if outside else Badge("inside", "inside the trained range", expected)


def _expected(shown: ColumnFrame, alone: bool) -> str:
    """What is known of the error of the first model, which is named if it is not `alone`."""
    band, of = shown.error_band(np.array([shown.time])), "" if alone else f"{shown.column.label}: "
    if band is None:
        return f"{of}error not known"
    # outside of what was measured the band is carried on
    rough = "roughly " if shown.motion.outside or shown.motion.extrapolates(shown.time) else ""
    return f"{of}error in 9 of 10 cases {rough}below {band[0, 1]:.2g} mm"


def summarize(frame: Frame) -> str:
    """HTML: the badge, and in lines below what acts, what is wrong, and what is still computed."""
    lines = [badge_of(frame).html]
    if (push := first_push(frame)) is not None:
        lines.append(describe_push(*push))
    if errors := [f"{escape(c.column.label)} RMS {c.error.rms_mm:.2f} mm" for c in frame.columns if c.error]:
        lines.append(f"error now: {', '.join(errors)}")
    truth = frame.truth
    if truth is not None and truth.ended and truth.column.truth:
        lines.append(f"no truth after {truth.column.truth.end:.3g} s: its last moment is shown, pale")
    if low := [c.column.label for c in frame.columns if c.below_floor]:
        deepest = max(c.depth for c in frame.columns)
        lines.append(f"⚠ {escape(', '.join(low))}: {1e3 * deepest:.0f} mm below the floor")
    lines += [f"… {escape(label)} is being computed" for label in frame.pending]
    lines += [f"⚠ {escape(reason)}" for reason in frame.refused]
    if frame.off_truth:
        lines.append(OFF_TRUTH)
    elif truth is not None and truth.column.truth and truth.column.truth.unknown:
        lines.append(UNKNOWN.format(escape(", ".join(truth.column.truth.unknown))))
    return "<br>".join(lines)


class SummaryPanel(Panel):
    """A badge and a few lines of text over the scene; sent only when they change."""

    def __init__(self, page: Page) -> None:
        self._text = page.server.gui.add_html(in_view("trust", ""))

    def describe(self, description: Description) -> None:
        set_content(self._text, in_view("trust", summarize(description.frame)))

    def show_error(self, message: str) -> None:
        set_content(self._text, in_view("trust", f"⚠ <b>{escape(message)}</b>"))
