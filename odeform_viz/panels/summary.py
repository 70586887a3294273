"""How far the current frame can be trusted, what acts, and why a request cannot be met; always in view."""

from collections.abc import Sequence
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
from odeform_viz.words import known_range, parameter_title, rounded

__all__ = ["Badge", "SummaryPanel", "badge_of", "summarize"]

OFF_TRUTH = "The truth was simulated with other parameters, so no errors are shown."
INSIDE, EXTRAPOLATED, UNTRAINED = "inside the trained range", "extrapolated", "shape not trained"
UNKNOWN_ERROR, REFUSED = "no error estimate", "not modelled"
UNTESTED, HARDLY_TESTED = "not tested", "hardly tested"
UNRELIABLE, LIMITED, UNLEARNED = "not reliable", "too much deformation", "nothing learned"
LARGE = 0.2  # of the body's size: an error from which on nothing is told of where the body is
WHY = {
    INSIDE: "Parameters and time are within those of the simulations that the model has learned from.",
    EXTRAPOLATED: "The model has not learned from simulations like this one; its motion is carried on from them.",
    UNTRAINED: "The model has learned from simulations of other shapes.",
    UNKNOWN_ERROR: "The body moves by the laws of elasticity and contact. At most its contacts were fitted to motions "
    "like this one, so that no error is known for it. The documentation of loads says how far others were off.",
    UNTESTED: "No simulation with a mass or stiffness like this one was compared with the model.",
    HARDLY_TESTED: "A few simulations with half and twice the mass or stiffness were compared with the model. The "
    "documentation of results says how far they were off.",
    UNRELIABLE: "The error that is expected is more than a fifth of the body's size.",
    LIMITED: "The body deforms more than the model can follow: its way is computed, its shape is a guess.",
    UNLEARNED: "The elasticity of the body moves it. Nothing of it was learned from motions.",
    REFUSED: "The motion would not be physically possible from here on, so its last valid moment is shown.",
}
OF_TRUTH = "Not known of the truth: {}. Errors are those of the model and of the sliders together."


@dataclass(frozen=True)
class Badge:
    """How far a frame can be trusted: "inside" what was trained, "outside" of it, or "unknown"; and why, in words."""

    level: str
    text: str
    """A word or two; `WHY` has the rest."""
    detail: str = ""
    """What it is of, such as the parameters that are outside."""
    expected: str = ""
    """The error that is expected; empty where no model is in view."""

    @property
    def html(self) -> str:
        """The text in the colour of its level, and beside it the detail with the expected error."""
        beside = escape("; ".join(filter(None, (self.detail, self.expected))))
        why = escape(WHY.get(self.text, ""))
        return f'<span class="odeform-badge {self.level}" title="{why}">{escape(self.text)}</span> {beside}'


def badge_of(frame: Frame) -> Badge:
    """The least that holds for all models in view."""
    models = [c for c in frame.columns if c.column.predictor]
    if not models:
        return Badge("unknown", "no model in view", "only the truth" if frame.columns else "")
    for shown in models:
        of, motion = f"{shown.column.label}: " if len(models) > 1 else "", shown.motion
        if isinstance(motion, Motion) and frame.request.time > motion.last_good:
            return Badge("unknown", REFUSED, f"{of}{motion.stats.status} after t = {motion.last_good:.3f} s")
        if stop := shown.stop_at(frame.request.time):
            return Badge("unknown", LIMITED if stop.limited else REFUSED, f"{of}{stop}")
        only = motion.only_at if isinstance(motion, Motion) else None
        if only is not None and abs(frame.request.time - only) > 1e-6:
            return Badge("unknown", REFUSED, f"only t = {only:.3g} s is predicted, and shown")
    expected, outside = _expected(models), _outside(frame, models)
    if untrained := [c for c in models if c.untrained]:
        known = all(c.column.predictor and c.column.predictor.knows_untrained_errors for c in untrained)
        return Badge("outside" if known else "unknown", UNTRAINED, outside, expected)
    if load_of_scene(models[0].motion.schema.scene) is not None:
        # amber: what moves it is modelled, and no data say how well under this load
        return Badge("outside", UNKNOWN_ERROR, outside, "" if expected == UNKNOWN_ERROR else expected)
    if models[0].motion.schema.scene == CLAMPED:
        return Badge("outside", UNLEARNED, outside, expected)
    if any(c.changed for c in models):
        return _changed(models, outside, expected)
    if outside and any(_useless(c) for c in models):
        return Badge("unknown", UNRELIABLE, outside, expected)
    return Badge("outside", EXTRAPOLATED, outside, expected) if outside else Badge("inside", INSIDE, "", expected)


def _changed(models: Sequence[ColumnFrame], outside: str, expected: str) -> Badge:
    """That of a body of another mass or stiffness than its own: some were simulated in the range of the sliders."""
    motions = [c.motion for c in models]
    far = any(p.role == "body" and p.name in motion.outside for motion in motions for p in motion.schema.parameters)
    level, text = ("unknown", UNTESTED) if far else ("outside", HARDLY_TESTED)
    return Badge(level, text, "; ".join(filter(None, ("mass or stiffness", outside))), expected)


def _outside(frame: Frame, models: Sequence[ColumnFrame]) -> str:
    """What is beyond the data, in words; empty if nothing is."""
    schema = models[0].motion.schema
    titles = {p.name: parameter_title(p) for p in schema.parameters}
    names = [titles.get(name, name) for c in models for name in c.motion.outside] + outside_of_push(frame)
    if models[0].motion.extrapolates(frame.request.time):
        names.insert(0, "time")
    *first, last = dict.fromkeys(names) or ("",)
    listed = f"{', '.join(first)} and {last}" if first else last
    return f"{listed} beyond the {known_range(schema)}" if names else ""


def _below(shown: ColumnFrame) -> float | None:
    """The RMS distance in mm that the error stays below in nine of ten cases; None if it is not known."""
    band = shown.error_band(np.array([shown.time]))
    return None if band is None else float(band[0, 1])


def _useless(shown: ColumnFrame) -> bool:
    """Whether the error that is expected is a large part of the body's size."""
    below, size = _below(shown), float(np.ptp(shown.column.geometry.points, axis=0).max())
    return below is not None and below > 1e3 * LARGE * size


def _expected(models: Sequence[ColumnFrame]) -> str:
    """What is known of the error of the models at this moment: the largest of several."""
    bands = [_below(shown) for shown in models]
    unknown = [shown.column.label for shown, band in zip(models, bands, strict=True) if band is None]
    known = [band for band in bands if band is not None]
    if not known:
        return UNKNOWN_ERROR
    # outside of what was measured the band is carried on
    rough = any(c.motion.outside or c.motion.extrapolates(c.time) for c in models)
    of = "" if len(known) == 1 else f", the largest of {len(known)}"
    text = f"expected error now {'roughly ' if rough else ''}below {rounded(max(known), 2)} mm in 9 of 10 cases{of}"
    return "; ".join([text, *(f"{label}: {UNKNOWN_ERROR}" for label in unknown)])


def _errors_now(frame: Frame) -> list[str]:
    """The errors against the truth, and a remark where one is larger than expected."""
    known = [(c, c.error.rms_mm) for c in frame.columns if c.error]
    if not known:
        return []
    named = len(known) > 1
    values = ", ".join(
        f"{escape(c.column.label)} {rounded(rms)} mm" if named else f"{rounded(rms)} mm" for c, rms in known
    )
    lines = [f"error now: {values} (RMS distance)"]
    above = [c.column.label for c, rms in known if (below := _below(c)) is not None and rms > below]
    if above:
        of = f" of {escape(', '.join(above))}" if named else ""
        lines.append(f"⚠ the error{of} is above what is expected in 9 of 10 cases")
    return lines


def summarize(frame: Frame) -> str:
    """HTML: the badge, and in lines below what acts, what is wrong, and what is still computed."""
    lines = [badge_of(frame).html]
    if (push := first_push(frame)) is not None:
        lines.append(describe_push(*push))
    lines += _errors_now(frame)
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
        lines.append(OF_TRUTH.format(escape(", ".join(truth.column.truth.unknown))))
    return "<br>".join(lines)


class SummaryPanel(Panel):
    """A badge and a few lines of text over the scene; sent only when they change."""

    def __init__(self, page: Page) -> None:
        self._text = page.server.gui.add_html(in_view("trust", ""))

    def describe(self, description: Description) -> None:
        set_content(self._text, in_view("trust", summarize(description.frame)))

    def show_error(self, message: str) -> None:
        set_content(self._text, in_view("trust", f"⚠ <b>{escape(message)}</b>"))
