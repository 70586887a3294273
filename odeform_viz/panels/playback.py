"""Time: a slider past the trained window, play and pause, speed, steps."""

import asyncio
from collections.abc import Callable

import viser

from odeform.errors import InputError
from odeform.schema import Window
from odeform_viz.runtime.clock import Clock
from odeform_viz.view import REACH

__all__ = ["PlaybackPanel"]

SPEEDS = {"true speed": 1.0, "1/2": 0.5, "1/5": 0.2, "1/10": 0.1, "1/50": 0.02}


class PlaybackPanel:
    """Drives a clock. A hand on the time slider stops the playing; the slider follows the clock otherwise."""

    def __init__(
        self,
        server: viser.ViserServer,
        window: Window,
        clock: Clock,
        wake: Callable[[], None],
        largest: Callable[[], float],
        say: Callable[[str], None],
    ) -> None:
        """`largest` finds the moment of the largest deformation; `say` shows a message."""
        self._say = say
        self._clock, self._wake, self._window, self._largest = clock, wake, window, largest
        self._asked = 0  # moments that a hand has asked for: a peak takes a while to find, and may come too late
        span = window.stop - window.start
        with server.gui.add_folder("Time"):
            self._time = server.gui.add_slider(
                "time (s)",
                min=window.start,
                max=round(window.start + REACH * span, 4),
                step=0.0005,
                initial_value=window.start,
                marks=((window.start, f"{window.start:g}"), (window.stop, f"trained to {window.stop:g}")),
                hint="beyond the trained window the motion is extrapolated",
            )
            self._time.on_update(self._dragged)
            self._play = server.gui.add_button("Pause", icon=viser.Icon.PLAYER_PAUSE)
            self._play.on_click(lambda _: self.toggle())
            go = server.gui.add_button_group("go to", ("start", "◀", "▶", "peak"))
            go.on_click(self._clicked)
            go.hint = "start, frame before, frame after, largest deformation"
            self._speed = server.gui.add_dropdown("speed", tuple(SPEEDS), initial_value="1/5")
            self._speed.on_update(lambda _: self._changed())
            self._loop = server.gui.add_checkbox("loop", initial_value=True)
            self._loop.on_update(lambda _: self._changed())
        self._changed()

    async def _dragged(self, event: viser.GuiEvent) -> None:
        # a coroutine runs at once where the message came in, before the clock moves the slider on
        if event.client_id is not None:  # a hand, not the clock
            moment = self._time.value
            if not self._time.min <= moment <= self._time.max:
                self._say(f"time: expected seconds from {self._time.min:g} to {self._time.max:g}, got {moment:g}")
                self.show(self._clock.time())
                return
            self._asked += 1
            self.jump(moment)

    async def _clicked(self, event: viser.GuiEvent) -> None:
        which, self._asked = event.target.value, self._asked + 1
        if which == "peak":
            await asyncio.to_thread(self._to_peak, self._asked)
        else:
            self._to_frame(which)

    def _changed(self) -> None:
        if self._speed.value in SPEEDS:
            self._clock.set_speed(SPEEDS[self._speed.value])
        else:
            self._say(f"speed: expected one of {', '.join(SPEEDS)}, got {self._speed.value!r}")
        self._clock.loop = bool(self._loop.value)
        self._wake()

    def toggle(self) -> None:
        self._clock.pause() if self._clock.playing else self._clock.play()
        self._refresh_button()
        self._wake()

    def step(self, which: str) -> None:
        """To the `start`, the frame before (`◀`) or after (`▶`), or the `peak` of the deformation."""
        self._asked += 1
        self._to_peak(self._asked) if which == "peak" else self._to_frame(which)

    def _to_frame(self, which: str) -> None:
        frame = 1.0 / self._window.rate
        index = round((self._clock.time() - self._window.start) / frame)
        if which in (steps := {"start": 0, "◀": index - 1, "▶": index + 1}):
            self.jump(self._window.start + max(steps[which], 0) * frame)

    def _to_peak(self, asked: int) -> None:
        try:
            peak = self._largest()
        except InputError as error:
            self._say(str(error))
            return
        if asked == self._asked:
            self.jump(peak)

    def jump(self, moment: float) -> None:
        """Pause at a moment."""
        self._clock.pause()
        self._clock.seek(min(max(moment, self._time.min), self._time.max))
        self._refresh_button()
        self._wake()

    def _refresh_button(self) -> None:
        playing = self._clock.playing
        self._play.label = "Pause" if playing else "Play"
        self._play.icon = viser.Icon.PLAYER_PAUSE if playing else viser.Icon.PLAYER_PLAY

    def show(self, moment: float) -> None:
        """Let the slider follow; called by the worker."""
        self._time.value = min(max(round(moment, 4), self._time.min), self._time.max)
        if self._play.label == "Pause" and not self._clock.playing:
            self._refresh_button()
