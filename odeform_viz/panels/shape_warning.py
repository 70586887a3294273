"""Always visible while a shape is shown that was not trained: how far it is from what was trained."""

from collections.abc import Iterable
from html import escape

from odeform.geometry.shape_similarity import ShapeSimilarity
from odeform_viz.page import Page, Panel
from odeform_viz.panels.callbacks import set_content
from odeform_viz.panels.in_view import in_view
from odeform_viz.user_bodies import UserBodyPredictor
from odeform_viz.view import Description

__all__ = ["ShapeWarningPanel", "shape_warning"]

STYLE = "margin:-5px -10px;padding:3px 10px;border-radius:6px;color:#fff;background:"
GUESSED, UNKNOWN = "#b06a00", "#b3260c"  # of the badge: whether an error is known


def shape_warning(similarities: Iterable[ShapeSimilarity | None], model: UserBodyPredictor | None = None) -> str:
    """HTML; empty if all shapes were trained, or nothing is known of the trained ones.

    `model` is a mechanical model that has made a body of the shape.
    """
    untrained = [similarity for similarity in similarities if similarity is not None and not similarity.same]
    if not untrained:
        return ""
    worst = max(untrained, key=lambda similarity: similarity.mean)
    color = GUESSED if model is not None and model.knows_untrained_errors else UNKNOWN
    away = f"on average {1e3 * worst.mean:.0f} mm from the trained body's"
    more = f"The largest distance is {1e3 * worst.distance:.0f} mm. {_motion(model)}."
    return f'<div style="{STYLE}{color}" title="{escape(more)}">⚠ <b>Shape not trained</b>: its surface is {away}</div>'


def _motion(model: UserBodyPredictor | None) -> str:
    if model is None:
        return "It is moved as the trained body; no error is known"
    motion = model.describe_motion().capitalize()
    return f"{motion}, {model.describe_error()}"


class ShapeWarningPanel(Panel):
    """A coloured box over the scene. It is there before the first frame of a shape is drawn."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self._box = page.server.gui.add_html(in_view("shape", ""))
        page.on_columns_changed(self._refresh)
        self._refresh()

    def describe(self, description: Description) -> None:
        # in a scene with several objects, the parameters select the trained body
        self._show(shape_warning((shown.similarity for shown in description.frame.columns), self._user_model))

    def _refresh(self) -> None:
        columns = [c for c in self._page.columns.all if c.visible and c.predictor]
        similarities = (c.predictor.validity.similarity(c.geometry) for c in columns if c.predictor)
        self._show(shape_warning(similarities, self._user_model))

    @property
    def _user_model(self) -> UserBodyPredictor | None:
        predictor = self._page.model.predictor
        return predictor if isinstance(predictor, UserBodyPredictor) else None

    def _show(self, text: str) -> None:
        set_content(self._box, in_view("shape", text))
