"""Time: the timeline under the scene, past the trained window; play and pause, speed, steps."""

import asyncio

import viser

from odeform.errors import InputError
from odeform.loads.registry import known_as
from odeform_viz.page import Page, Panel
from odeform_viz.panels.callbacks import set_content
from odeform_viz.panels.in_view import in_view
from odeform_viz.panels.timeline import Marks, moment_css, playing_css, timeline_html
from odeform_viz.pushing import acting_times
from odeform_viz.state import PageState
from odeform_viz.view import Description, shown_until

__all__ = ["PlaybackPanel"]

PREVIOUS, NEXT = "prev", "next"  # frame
SPEEDS = {"real time": 1.0, "1/2": 0.5, "1/5": 0.2, "1/10": 0.1, "1/20": 0.05, "1/50": 0.02}
USUAL = 0.2  # of real time, or slower:
LEAST = 3.0  # s that the trained window takes
AFTER = {
    "trained": "after the trained window, the motion is extrapolated",
    "measured": "the error of such motions was measured up to there",
    "shown": "the motion is computed up to there, and held afterwards",
}
QUIET = 0.3  # s after a drag; times that the clock had set have arrived by then


class PlaybackPanel(Panel):
    """Drives the clock. Dragging the time slider pauses; otherwise the slider follows the clock."""

    def __init__(self, page: Page) -> None:
        self._page, self._clock, self._window = page, page.clock, page.schema.window
        self._seeks = 0  # by the user; finding a peak takes a while, and a later seek cancels it
        self._confirming: asyncio.TimerHandle | None = None
        self._known = known_as(page.schema.scene)
        start, stop = self._window.start, self._window.stop
        gui = page.server.gui
        with gui.add_folder("Time"):
            self._time = gui.add_slider(
                "time (s)",
                min=start,
                max=round(shown_until(self._window), 4),
                step=0.0005,
                initial_value=start,
                marks=((start, f"{start:g}"), (stop, f"{self._known} until {stop:g} s")),
                hint=AFTER[self._known],
            )
            self._time.on_update(self._dragged)
            page.controls.time_slider = self._time._impl.uuid
            self._play = gui.add_button("Pause")
            self._play.on_click(lambda _: self.toggle())
            go = gui.add_button_group("go to", ("start", PREVIOUS, NEXT, "peak"))
            go.on_click(self._clicked)
            self._speed = gui.add_dropdown("speed", tuple(SPEEDS), initial_value=_usual_speed(page.clock.stop - start))
            self._speed.on_update(lambda _: self._changed())
            self._loop = gui.add_checkbox("loop", initial_value=True)
            self._loop.on_update(lambda _: self._changed())
        self._timeline, self._moment, self._state = (gui.add_html("") for _ in range(3))
        self._marks: Marks | None = None
        page.add_hotkey("space K", "play or pause", self.toggle)
        page.add_hotkey("arrowleft J", "previous frame", lambda: self.step(PREVIOUS))
        page.add_hotkey("arrowright L", "next frame", lambda: self.step(NEXT))
        page.add_hotkey("0", "go to the start", lambda: self.step("start"))
        page.add_hotkey("P", "go to the peak of the deformation", lambda: self.step("peak"))
        page.add_hotkey("S", "another speed", self._next_speed)
        page.add_hotkey("R", "repeat or play once", lambda: setattr(self._loop, "value", not self._loop.value))
        self._changed()

    def describe(self, description: Description) -> None:
        self._marks = _marks_of(description)
        set_content(self._moment, moment_css(self._window, description.frame.request.time))
        self._page.on_event_loop(self._follow_clock)

    def restore(self, state: PageState) -> None:
        self._speed.value = next((name for name, speed in SPEEDS.items() if speed == state.speed), self._speed.value)
        self._loop.value = state.loop
        self.jump(state.time)

    def toggle(self) -> None:
        """Play or pause."""
        self._clock.pause() if self._clock.playing else self._clock.play()
        self._page.on_event_loop(self._refresh_button)
        self._page.wake()

    def step(self, target: str) -> None:
        """Go to the "start", the `PREVIOUS` or `NEXT` frame, or the "peak" of the deformation."""
        self._seeks += 1
        self._to_peak(self._seeks) if target == "peak" else self._to_frame(target)

    def jump(self, time: float) -> None:
        """Pause at a time in seconds."""
        self._page.pause_at(min(max(time, self._time.min), self._time.max))
        self._page.on_event_loop(self._refresh_button)

    async def _dragged(self, event: viser.GuiEvent) -> None:
        # a coroutine runs at once where the message arrives, before the slider follows the clock again
        if event.client_id is None:
            return  # set by the clock
        time = self._time.value
        if not self._time.min <= time <= self._time.max:
            expected = f"expected seconds from {self._time.min:g} to {self._time.max:g}"
            self._page.notices.show("Time not set", f"time: {expected}, got {time:g}")
            self._follow_clock()
            return
        self._seeks += 1
        self.jump(time)
        if self._confirming is not None:
            self._confirming.cancel()
        self._confirming = asyncio.get_running_loop().call_later(QUIET, self._confirm)

    def _confirm(self) -> None:
        """Send the time of the slider once more: one that the clock had set may have arrived after the user's own."""
        time = self._time.value
        # a value is sent if it is another one, and of two at once only the last
        self._time.value = self._time.min if time > self._time.min else self._time.max
        self._time.value = time

    async def _clicked(self, event: viser.GuiEvent) -> None:
        target, self._seeks = event.target.value, self._seeks + 1
        if target == "peak":
            await asyncio.to_thread(self._to_peak, self._seeks)
        else:
            self._to_frame(target)

    def _changed(self) -> None:
        if self._speed.value in SPEEDS:
            self._clock.set_speed(SPEEDS[self._speed.value])
        else:
            expected = f"expected one of {', '.join(SPEEDS)}"
            self._page.notices.show("Speed not set", f"speed: {expected}, got {self._speed.value!r}")
        self._clock.loop = bool(self._loop.value)
        self._page.on_event_loop(self._draw)
        self._page.wake()

    def _next_speed(self) -> None:
        names = list(SPEEDS)
        now = names.index(self._speed.value) if self._speed.value in names else -1
        self._speed.value = names[(now + 1) % len(names)]

    def _draw(self) -> None:
        slider = self._page.controls.time_slider
        content = timeline_html(
            self._window, slider, self._marks, str(self._speed.value), bool(self._loop.value), self._known
        )
        set_content(self._state, playing_css(self._clock.playing))
        set_content(self._timeline, in_view("timeline", content))

    def _to_frame(self, target: str) -> None:
        frame = 1.0 / self._window.rate
        index = round((self._clock.time() - self._window.start) / frame)
        if target in (steps := {"start": 0, PREVIOUS: index - 1, NEXT: index + 1}):
            self.jump(self._window.start + max(steps[target], 0) * frame)

    def _to_peak(self, seek: int) -> None:
        try:
            peak = self._page.session.largest_deformation(self._page.request())
        except InputError as error:
            self._page.notices.show("Peak not found", str(error))
            return
        if seek == self._seeks:
            self.jump(peak)

    def _refresh_button(self) -> None:
        # on the event loop alone: labels set by two threads at once may arrive in the other order
        playing = self._clock.playing
        self._play.label = "Pause" if playing else "Play"
        self._draw()

    def _follow_clock(self) -> None:
        self._time.value = min(max(round(self._clock.time(), 4), self._time.min), self._time.max)
        if (self._play.label == "Pause") != self._clock.playing:
            self._refresh_button()
        self._draw()


def _marks_of(description: Description) -> Marks | None:
    """The motion of the first column in view, and what acts on it."""
    if not description.frame.columns:
        return None
    shown, truth = description.frame.columns[0], description.frame.truth
    record = truth.column.truth if truth else None
    end = record.end if record and not record.rests else None  # a body that rests stays where it is
    return Marks(description.curves[0], acting_times(shown), end)


def _usual_speed(window: float) -> str:
    """The name of the speed for a trained window of that many seconds."""
    slow_enough = (name for name, speed in SPEEDS.items() if speed <= USUAL and window >= LEAST * speed)
    return next(slow_enough, list(SPEEDS)[-1])
