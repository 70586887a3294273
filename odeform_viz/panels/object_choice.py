"""The choice of a body among those of a scene, and what its sliders of mass and stiffness are."""

from odeform.schema import OBJECT, Parameter
from odeform_viz.page import Page
from odeform_viz.user_bodies import user_body_of

__all__ = ["ObjectChoice"]


class ObjectChoice:
    """A list of objects; hidden while a shape of the user's own moves."""

    def __init__(self, page: Page) -> None:
        """Adds the list to the page's controls."""
        self._page, objects = page, page.schema.objects
        self._control = page.server.gui.add_dropdown("object", objects, hint="the body that moves")
        self._control.on_update(lambda _: page.wake())
        self._known: object = None

    @property
    def name(self) -> str:
        """The object as parameters name it: the one that a user's own body is like."""
        body = user_body_of(self._page.model.predictor)
        return self._control.value if body is None or body.like not in self._page.schema.objects else body.like

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Those of the body itself, with its own values as defaults."""
        predictor = self._page.model.predictor
        assert predictor is not None
        schema = predictor.model_of({OBJECT: self.name}).schema
        return tuple(p for p in schema.parameters if p.role == "body")

    @property
    def own(self) -> dict[str, float]:
        """Their values of the body as it is by itself."""
        return {p.name: p.default for p in self.parameters}

    def choose(self, name: str) -> bool:
        """Choose an object; whether another body moves now."""
        self._control.value = self._page.schema.check_object(name)
        return self.changed()

    def changed(self) -> bool:
        """Whether another body moves than when this was asked last."""
        body = user_body_of(self._page.model.predictor)
        self._control.visible = body is None and len(self._page.schema.objects) > 1
        before, self._known = self._known, self.name if body is None else body
        return before is not self._known and before != self._known
