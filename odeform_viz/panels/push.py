"""Sets what a sphere pushes, where and how hard: an object, a contact to click, a force in the contact's frame."""

import math
import threading
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import viser

from odeform.errors import InputError
from odeform.geometry.contact import CONE, SurfacePoint, nearest_on, touching_centre
from odeform.geometry.push import Push, push_of
from odeform.loads.registry import known_as
from odeform.schema import OBJECT, Parameter
from odeform.simulation.contacts import contact_parameters, push_from
from odeform.types import Mesh, Vector
from odeform_viz.columns import Column
from odeform_viz.page import Page, Panel
from odeform_viz.panels.callbacks import set_content
from odeform_viz.pushing import ShownPush, contacts_of, push_excess, surface_of
from odeform_viz.state import PageState
from odeform_viz.user_bodies import user_body_of
from odeform_viz.view import Description
from odeform_viz.words import known_range, parameter_title

__all__ = ["PushPanel"]

MARGIN = 1.5  # times the strongest trained force: the end of the slider
WIDEST = 60.0  # degrees of each tilt
STRAIGHT, BACK = "no tilt", "defaults"
THIN = "Here the body is thin: {:.2g} to {:.2g} N suit it, elsewhere up to {:.2g} N."
HINT = "Click the body to choose where {what}. Drag the ball at the arrow's tail to change the force."


class PushPanel(Panel):
    """Holds the scene's own parameters; the sliders show them in the contact's frame, and change them."""

    def __init__(self, page: Page) -> None:
        self._page, self._schema = page, page.schema
        self._lock = threading.RLock()
        self._left: dict[str, dict[str, Any]] = {}  # by object: its parameters when it was left
        self._resumes: tuple[bool, float] | None = None  # whether it played, and when, before the arrow was dragged
        body = user_body_of(page.model.predictor)
        liked = body is not None and body.like in self._schema.objects
        self._parameters = self._defaults(body.like if body and liked else self._schema.objects[0])
        self._surface = surface_of(page.model, self._parameters)
        gui = page.server.gui
        contacts = contacts_of(page.schema)
        self._sphere = contacts is not None and contacts.radius > 0.0
        with gui.add_folder("Push" if self._sphere else "Kick"):
            self._object = gui.add_dropdown(
                "object", self._schema.objects, visible=len(self._schema.objects) > 1, hint="the body"
            )
            self._text = gui.add_markdown("")
            self._strength = gui.add_slider("force (N)", 0.0, 1.0, 0.01, 0.0, hint="")
            self._up = self._add_tilt(
                gui, "tilt up (°)", "angle by which the force leans upwards, from straight into the surface"
            )
            self._side = self._add_tilt(
                gui, "tilt sideways (°)", "angle by which the force leans sideways, from straight into the surface"
            )
            self._body = {
                p.name: gui.add_slider(f"{parameter_title(p)} ({p.unit})", 0.0, 1.0, 0.001, 0.0)
                for p in self._of_body()
            }
            buttons = gui.add_button_group("set to", (STRAIGHT, BACK), hint="the direction, or all of these sliders")
            buttons.on_click(self._clicked)
        for control in (self._object, self._strength, self._up, self._side, *self._body.values()):
            control.on_update(lambda _: page.wake())
        self._write()
        controls = page.controls
        controls.parameters, controls.set_parameters = self.parameters, self.set
        controls.pick, controls.pull = self.pick, self.pull
        page.on_columns_changed(self._follow_surface)
        self._show()

    @classmethod
    def needed(cls, page: Page) -> bool:
        return contacts_of(page.schema) is not None

    def _add_tilt(self, gui: viser.GuiApi, name: str, hint: str) -> viser.GuiSliderHandle[float]:
        cone = math.degrees(CONE)
        marks = ((-cone, f"-{cone:.0f}"), (0.0, "0"), (cone, f"{cone:.0f}"))
        return gui.add_slider(name, -WIDEST, WIDEST, 0.5, 0.0, marks=marks, hint=hint)

    def parameters(self) -> dict[str, Any]:
        """Returns the scene's parameters. `InputError` for values that no control can have."""
        with self._lock:
            self._follow_surface()
            values = self._values()
            if values == self._written:
                return dict(self._parameters)
            self._check(values)
            name, strength, up, side, *body = values
            changed = zip(self._body, body, self._written[4:], strict=True)
            self._parameters = {**self._parameters, **{key: new for key, new, old in changed if new != old}}
            if (strength, up, side) != self._written[1:4]:
                contact = push_from(self._parameters, self._surface).contact
                self._adopt(Push(contact, float(strength), math.radians(up), math.radians(side)))
            self._written = (self._written[0], strength, up, side, *body)
            if name != self._written[0]:
                self._change_object(name)
            return dict(self._parameters)

    def set(self, parameters: Mapping[str, Any]) -> None:
        """Set the scene's parameters of these names. `InputError` for unknown ones and values no motion can have."""
        with self._lock:
            changed = parameters.get(OBJECT, self._parameters[OBJECT]) != self._parameters[OBJECT]
            base = {} if changed else self._parameters
            self._parameters = self._schema.complete({**base, **self._completed(parameters, changed)})
            self._surface = surface_of(self._page.model, self._parameters)
            self._write()
        self._page.wake()

    def pick(self, column: Column | None, point: Vector) -> None:
        """Move the contact to a point (3,) m of the shape at rest, with the same force in its frame, as strong for the
        place as it was.

        Without a column nothing happens: a click on the floor is meant for nothing.
        """
        if column is None:
            return
        try:
            with self._lock:
                parameters = self.parameters()
                self._check_pick(column, parameters)
                contact = nearest_on(self._surface, point)
                if self._sphere and touching_centre(self._surface, contact) is None:
                    raise InputError("The sphere does not fit there: the floor or a part of the body is in its way.")
                self._adopt(self._suited(push_from(parameters, self._surface), contact))
                self._write()
        except InputError as error:
            self._page.notices.show("Contact not moved", str(error))
            return
        if self._page.clock.playing:
            self._page.clock.seek(self._schema.window.start)
        self._page.wake()

    def pull(self, push: ShownPush, tail: Vector, phase: str) -> None:
        """Follow the arrow's tail, which is dragged to (3,) m; the body is at rest meanwhile, and moves afterwards."""
        clock, start = self._page.clock, self._schema.window.start
        if phase == "start":
            self._resumes = clock.playing, clock.time()
            self._page.pause_at(start)
        with self._lock:
            self._adopt(self._limited(push_of(push.push.contact, push.pulled_to(tail))))
            self._write()
        if phase == "end" and self._resumes is not None:
            played, time = self._resumes
            clock.seek(start if played else time)
            if played:
                clock.play()
        self._page.wake()

    def describe(self, description: Description) -> None:
        self._show()

    def show_error(self, message: str) -> None:
        self._show()

    def restore(self, state: PageState) -> None:
        self.set(state.parameters)

    def _completed(self, parameters: Mapping[str, Any], changed: bool) -> dict[str, Any]:
        """Adds the defaults of an object that was not shown before."""
        return {**self._defaults(str(parameters[OBJECT])), **parameters} if changed else dict(parameters)

    def _defaults(self, name: str) -> dict[str, Any]:
        predictor = self._page.model.predictor
        assert predictor is not None
        return predictor.complete({OBJECT: name})

    def _forces(self, parameters: Mapping[str, Any] | None = None) -> tuple[float, float]:
        """Newton, weakest and strongest at the contact of parameters; by default on the whole body."""
        predictor = self._page.model.predictor
        assert predictor is not None
        return predictor.force_range(parameters or {OBJECT: self._parameters[OBJECT]})

    def _suited(self, push: Push, contact: SurfacePoint) -> Push:
        """The push at another contact: a body of the user's own takes less where it is thin."""
        moved = push.at(contact)
        here, there = (self._forces({**self._parameters, **contact_parameters(p)})[1] for p in (push, moved))
        return replace(moved, strength=push.strength * there / here)

    def _of_body(self) -> list[Parameter]:
        """The properties of the body that is pushed."""
        predictor = self._page.model.predictor
        assert predictor is not None
        return [p for p in predictor.model_of(self._parameters).schema.parameters if p.role == "body"]

    def _values(self) -> tuple[Any, ...]:
        controls = (self._object, self._strength, self._up, self._side, *self._body.values())
        return tuple(control.value for control in controls)

    def _check(self, values: tuple[Any, ...]) -> None:
        self._schema.check_object(values[0])
        sliders = (self._strength, self._up, self._side, *self._body.values())
        for slider, value in zip(sliders, values[1:], strict=True):
            if not slider.min <= value <= slider.max:
                raise InputError(f"{slider.label}: expected {slider.min:g} to {slider.max:g}, got {value:g}")

    def _check_pick(self, column: Column, parameters: Mapping[str, Any]) -> None:
        name = parameters[OBJECT]
        if column.pinned is not None:
            raise InputError(f"{column.label} is pinned: click a column that follows the sliders.")
        if column.truth is not None and column.truth.parameters.get(OBJECT) != name:
            raise InputError(f"The truth is of another object: click the {name}.")

    def _change_object(self, name: str) -> None:
        self._left[self._parameters[OBJECT]] = self._parameters
        self._parameters = self._left.get(name) or self._defaults(name)
        self._surface = surface_of(self._page.model, self._parameters)
        self._write()

    def _adopt(self, push: Push) -> None:
        self._parameters = {**self._parameters, **contact_parameters(push)}

    def _limited(self, push: Push) -> Push:
        """The nearest that the sliders can show."""
        far = max(push.angle / math.radians(WIDEST), 1.0)
        return Push(push.contact, min(push.strength, self._strength.max), push.up / far, push.side / far)

    def _follow_surface(self) -> None:
        """After another shape was loaded, the contact is on its surface."""
        with self._lock:
            surface: Mesh = surface_of(self._page.model, self._parameters)
            if surface is self._surface:
                return
            body = user_body_of(self._page.model.predictor)
            like = body.like if body and body.like in self._schema.objects else str(self._parameters[OBJECT])
            self._surface, self._left = surface, {}
            self._parameters = self._defaults(like)
            self._write()

    def _write(self) -> None:
        """Let the controls show the parameters."""
        with self._lock, self._page.server.atomic():
            name = str(self._parameters[OBJECT])
            push, (weakest, strongest) = push_from(self._parameters, self._surface), self._forces()
            self._object.visible = len(self._schema.objects) > 1 and not self._page.model.loaded
            self._strength.max = MARGIN * strongest
            of = "of the sphere on the body" if self._sphere else "peak of the pulse"
            self._strength.hint = f"{of}; {known_range(self._schema)} {weakest:g} to {strongest:g} N"
            shown = (round(push.strength, 3), round(math.degrees(push.up), 1), round(math.degrees(push.side), 1))
            self._object.value = name
            for slider, value in zip((self._strength, self._up, self._side), shown, strict=True):
                slider.value = min(max(value, slider.min), slider.max)
            for p in self._of_body():
                slider, value = self._body[p.name], float(self._parameters[p.name])
                slider.min, slider.max, slider.step = _rounded(p.low), _rounded(p.high), _rounded(p.low / 50.0)
                slider.hint = f"{p.description}; its own is {p.default:.3g} {p.unit}"
                slider.value = min(max(_rounded(value), slider.min), slider.max)
            self._written = self._values()

    def _show(self) -> None:
        with self._lock:
            parameters = self._parameters
            push = push_from(parameters, self._surface)
        forces, most = self._forces(parameters), self._forces()
        excess = push_excess(push, forces, known_as(self._schema.scene))
        parts = ", ".join(f"{name} ({limit})" for name, limit in excess.items())
        what = "the sphere pushes" if self._sphere else "it is kicked"
        # in place of the hint, which is as long: a line of its own would shove the sliders while one drags
        said = f"⚠ **beyond what is known**: {parts}" if excess else HINT.format(what=what)
        thin = f"  \n{THIN.format(forces[0], forces[1], most[1])}" if forces[1] < most[1] else ""
        set_content(self._text, said + thin)

    async def _clicked(self, event: viser.GuiEvent) -> None:
        # a coroutine runs soon where the message arrives, before a drag that follows it
        with self._lock:
            if event.target.value == BACK:
                self._parameters = self._defaults(str(self._parameters[OBJECT]))
            else:
                push = push_from(self.parameters(), self._surface)
                self._adopt(Push(push.contact, push.strength))
            self._write()
        self._page.wake()


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")
