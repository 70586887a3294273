"""Shows what is in view: scene, models and shape, what the colours mean, and what is not to scale."""

import re
from html import escape, unescape
from pathlib import Path

from odeform.models.titles import subject_of
from odeform.schema import OBJECT
from odeform.types import Floats
from odeform_viz.coloring.scale import gradient_html
from odeform_viz.colors import color_of
from odeform_viz.page import Page, Panel
from odeform_viz.panels.callbacks import set_content
from odeform_viz.panels.in_view import in_view
from odeform_viz.view import ColorScale, Description, DisplayOptions, Frame
from odeform_viz.words import model_title

__all__ = ["CaptionPanel", "caption_html", "scale_html", "subject_text"]

OF = {
    "displacement": "displacement from the rest shape",
    "strain": "largest principal strain of the surface",
    "error": "distance from the truth",
}


def caption_html(frame: Frame, options: DisplayOptions) -> str:
    """The lines that the frame needs, and no others."""
    lines = [f"<div>{_subject(frame)}</div>"]
    if options.exaggeration != 1.0:
        lines.append(f"<div><b>deformation exaggerated {options.exaggeration:g} times</b></div>")
    if options.overlay and len(frame.columns) > 1:
        lines.append(_legend(frame))
    return "".join(lines)


def subject_text(frame: Frame) -> str:
    """What moves and which models show it, without markup."""
    return unescape(re.sub(r"<[^>]+>", "", _subject(frame)))


def scale_html(scale: ColorScale | None, histogram: Floats | None) -> str:
    """Draws the colours of values with quantity and unit, and a histogram (BINS,) of them; empty without a scale."""
    if scale is None:
        return ""
    of = "this moment" if scale.momentary else "the whole motion"
    ticks = "".join(f"<span>{part * scale.top:g}</span>" for part in (0.0, 0.25, 0.5, 0.75))
    return (
        f'<div class="odeform-bar"><div>{OF[scale.quantity]}, {scale.unit} (scale of {of})</div>'
        f"{gradient_html(histogram)}"
        f'<div style="display:flex;justify-content:space-between">{ticks}<span>≥ {scale.top:g}</span></div></div>'
    )


def _subject(frame: Frame) -> str:
    """What moves and how, models, and the shape that was loaded."""
    if not frame.columns:
        return "no column is in view"
    models = list(dict.fromkeys(model_title(c.column.predictor) for c in frame.columns if c.column.predictor))
    truth = " beside the truth" if frame.truth and models else "the truth" if frame.truth else ""
    fit = next((c.column.fit for c in frame.columns if c.column.fit), None)
    own = str(frame.columns[0].motion.parameters.get(OBJECT, ""))
    scene, names = frame.columns[0].motion.schema.scene, ", ".join(models) + truth
    shape = "" if fit is None else Path(fit.origin).name or "uploaded shape"
    moves = subject_of(scene, own if fit is None or not own else shape)
    if shape and not own:
        return f"<b>{escape(shape)}</b>, moved as the {escape(moves)} · {escape(names)}"
    return f"<b>{escape(moves)}</b> · {escape(names)}"


def _legend(frame: Frame) -> str:
    names = (
        f'<span style="white-space:nowrap;margin-right:0.9em"><span style="display:inline-block;width:0.8em;'
        f'height:0.8em;border-radius:50%;margin-right:0.3em;background:rgb{color_of(shown.column)}"></span>'
        f"{escape(shown.column.label)}</span>"
        for shown in frame.columns
    )
    return f"<div>{' '.join(names)}</div>"


class CaptionPanel(Panel):
    """Text and a scale of colours over the scene; sent only when they change."""

    def __init__(self, page: Page) -> None:
        gui = page.server.gui
        self._caption, self._scale = gui.add_html(in_view("caption", "")), gui.add_html(in_view("scale", ""))

    def describe(self, description: Description) -> None:
        set_content(self._caption, in_view("caption", caption_html(description.frame, description.options)))
        set_content(self._scale, in_view("scale", scale_html(description.scale, description.histogram)))
