"""Shows what is in view: scene, models and shape, what the colours mean, and what is not to scale."""

from html import escape
from pathlib import Path

from odeform.schema import OBJECT
from odeform_viz.coloring.scale import gradient_css
from odeform_viz.colors import color_of
from odeform_viz.page import Page, Panel
from odeform_viz.view import ColorScale, Description, DisplayOptions, Frame

__all__ = ["CaptionPanel", "caption_html"]

OF = {
    "displacement": "displacement from the rest shape",
    "strain": "largest principal strain of the surface",
    "error": "distance from the truth",
}


def caption_html(frame: Frame, options: DisplayOptions, scale: ColorScale | None) -> str:
    """The lines that the frame needs, and no others."""
    lines = [f"<div>{escape(_subject(frame))}</div>"]
    if options.exaggeration != 1.0:
        lines.append(f"<div><b>deformation exaggerated {options.exaggeration:g} times</b></div>")
    if options.overlay and len(frame.columns) > 1:
        lines.append(_legend(frame))
    if scale is not None:
        lines.append(_bar(scale))
    return f'<div style="padding:0.6em 1em 0;font-size:0.85em;line-height:1.5">{"".join(lines)}</div>'


def _subject(frame: Frame) -> str:
    """Scene, models and shape."""
    if not frame.columns:
        return "no column is visible"
    models = list(dict.fromkeys(c.column.predictor.model for c in frame.columns if c.column.predictor))
    truth = ["truth"] if frame.truth else []
    fit = next((c.column.fit for c in frame.columns if c.column.fit), None)
    trained = frame.columns[0].motion.parameters.get(OBJECT, "trained body")
    shape = trained if fit is None else Path(fit.origin).name or "uploaded shape"
    return f"{frame.columns[0].motion.schema.scene} · {', '.join([*models, *truth])} · {shape}"


def _legend(frame: Frame) -> str:
    names = (
        f'<span style="white-space:nowrap;margin-right:0.9em"><span style="display:inline-block;width:0.8em;'
        f'height:0.8em;border-radius:50%;margin-right:0.3em;background:rgb{color_of(shown.column)}"></span>'
        f"{escape(shown.column.label)}</span>"
        for shown in frame.columns
    )
    return f"<div>{' '.join(names)}</div>"


def _bar(scale: ColorScale) -> str:
    ticks = "".join(f"<span>{part * scale.top:g}</span>" for part in (0.0, 0.5))
    return (
        f"<div>{OF[scale.quantity]}, {scale.unit} (scale fitted to this moment)</div>"
        f'<div style="height:10px;border-radius:3px;background:{gradient_css()}"></div>'
        f'<div style="display:flex;justify-content:space-between">{ticks}<span>≥ {scale.top:g}</span></div>'
    )


class CaptionPanel(Panel):
    """Text at the top of the side panel; sent only when it changes."""

    def __init__(self, page: Page) -> None:
        self._html = page.server.gui.add_html("")

    def describe(self, description: Description) -> None:
        content = caption_html(description.frame, description.options, description.scale)
        if self._html.content != content:
            self._html.content = content
