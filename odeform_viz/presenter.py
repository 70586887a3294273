"""The loop of the viewer: computes the newest request and shows it. Knows no GUI types."""

import contextlib
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Protocol

from odeform.cancellation import Cancelled, cancel_unless
from odeform.errors import InputError
from odeform_viz.coloring.colorist import Colorist
from odeform_viz.coloring.scale import histogram_of
from odeform_viz.runtime.clock import Clock
from odeform_viz.session import Session
from odeform_viz.view import (
    COLOR_BY,
    Coloring,
    ColorScale,
    Curves,
    Description,
    DisplayOptions,
    Frame,
    ViewRequest,
    peak_of,
    same_motions,
)

__all__ = ["Output", "Presenter", "Recording"]

TICK = 1.0 / 30.0  # s between frames while playing
SETTLE = 0.15  # s without a new request after which the view counts as settled
DESCRIBE = 0.2  # s between updates of numbers and curves; nobody reads faster
RARELY = 10.0  # times as long as an update took, until the next: those of many columns would hold up their frames


class Output(Protocol):
    """Receives the frames to show."""

    def publish(self, frame: Frame, options: DisplayOptions, coloring: Coloring | None) -> None:
        """Draw a frame, in the bodies' own colours without a `coloring`."""
        ...

    def describe(self, description: Description) -> None:
        """Update everything beside the viewport."""
        ...

    def outdate(self) -> None:
        """Mark what is beside the viewport: other motions are in view than those it describes."""
        ...

    def show_error(self, message: str) -> None:
        """Say why a request cannot be met; the last frame stays visible."""
        ...

    def settle(self) -> None:
        """Called once after the view has settled: the time to tidy up."""
        ...


class Recording(Protocol):
    """A recording of the frames, if any is in progress."""

    def sync(self) -> bool:
        """Start or stop as requested; whether a recording has just started."""
        ...

    def log(self, frame: Frame) -> None:
        """Add a frame, if a recording is in progress."""
        ...


class Presenter:
    """Serves requests on the worker's thread; a new one cancels the one being computed.

    While the user scrubs or plays, fast columns are shown immediately and slow ones follow. Numbers and curves are
    updated less often than frames, and completed once the view has settled.
    """

    def __init__(
        self,
        session: Session,
        clock: Clock,
        read: Callable[[], tuple[ViewRequest, DisplayOptions]],
        output: Output,
        recording: Recording,
        up_to_date: Callable[[], bool],
    ) -> None:
        """`read` returns the newest request, or raises `InputError`; `up_to_date` is false once there is a newer."""
        self._session, self._clock, self._read = session, clock, read
        self._output, self._recording, self._up_to_date = output, recording, up_to_date
        self.frame: Frame | None = None
        """The frame on screen; None before the first, and after a request that could not be met."""
        self._coloring: Coloring | None = None
        self._colorist = Colorist()
        self._options = DisplayOptions()
        self._settled = False
        self._fitted: object = None  # what the scale of colours was fitted to
        self._described: Frame | None = None
        self._described_at = 0.0
        self._pause = self._pace = DESCRIBE  # until other motions are described, or another moment of the same

    @property
    def scale(self) -> ColorScale | None:
        """The scale of the colours on screen; None for the bodies' own colours."""
        return self._coloring.scale if self._coloring else None

    @property
    def settled(self) -> bool:
        """Whether the frame on screen is complete: all columns computed, and everything described."""
        frame = self.frame
        return frame is not None and not frame.pending and self._settled and self._described is frame

    def serve(self) -> float | None:
        """One round. Returns the seconds until the next, or None if nothing will change without a new request."""
        try:
            if self._recording.sync():
                self.frame = None  # the current frame is shown again, so that the recording has it
            request, options = self._read()
            with cancel_unless(self._up_to_date):
                self._update(request, options)
        except Cancelled:
            return 0.0
        except InputError as error:
            self._output.show_error(str(error))
            # the next frame is shown even if it is the same as before the error
            self.frame, self._described, self._settled = None, None, True
        if self.frame and self.frame.pending:
            return 0.0
        if self._clock.playing:
            return TICK
        return None if self._settled and self._described is self.frame else SETTLE

    def _update(self, request: ViewRequest, options: DisplayOptions) -> None:
        frame = self.frame
        if frame is None or request != frame.request or options != self._options or frame.pending:
            # slow columns wait for the second round of the same request; while playing each round differs in time,
            # so there they are computed in the first round that has the same motions
            include_slow = frame is not None and (
                request == frame.request or (self._clock.playing and frame.differs_in_time_only(request))
            )
            self._show(self._session.frame(request, include_slow), options)
        elif not self._settled:
            self._settled = True
            self._describe(frame)
            self._output.settle()
        elif self._described is not frame:
            self._describe(frame)

    def _show(self, frame: Frame, options: DisplayOptions) -> None:
        self._settled = self.frame is not None and same_motions(frame, self.frame)
        self._publish(frame, options)
        self.frame, self._options = frame, options
        same = self._described is not None and same_motions(frame, self._described)
        if self._described is not None and not same:
            self._output.outdate()
        with cancel_unless(lambda: True):  # a frame that was shown is recorded, whatever came since
            self._recording.log(frame)
        if frame.pending or time.monotonic() - self._described_at > (self._pace if same else self._pause):
            self._describe(frame)

    def _publish(self, frame: Frame, options: DisplayOptions) -> None:
        self._coloring = self._colorist.color(frame, _quantity(options), options.momentary)
        self._output.publish(frame, options, self._coloring)

    def _fit_scale(self, frame: Frame, curves: Sequence[Curves]) -> None:
        """Fit the scale of colours to the largest values of the motions, once these have settled."""
        options = self._options
        fitted = ([c.motion for c in frame.columns], _quantity(options), options.momentary)
        if not self._settled or self.scale is None or fitted == self._fitted:
            return
        if options.momentary:
            self._fitted = fitted
            return
        peaks = {peak_of(each, self._clock.stop, options.color_by == "error") for each in curves}
        with contextlib.suppress(InputError):  # a moment that cannot be shown
            frames = [self._session.frame(replace(frame.request, time=peak)) for peak in sorted(peaks)]
            self._colorist.fit(frames, _quantity(options))
        self._fitted = fitted
        self._publish(frame, options)

    def _describe(self, frame: Frame) -> None:
        begin, again = time.monotonic(), self._described is not None and same_motions(frame, self._described)
        curves = tuple(self._session.curves(column, frame.request) for column in frame.columns)
        self._fit_scale(frame, curves)
        coloring = self._coloring
        histogram = histogram_of(coloring.values.values(), coloring.scale) if coloring else None
        self._output.describe(Description(frame, curves, self._options, self.scale, histogram, self._settled))
        self._described, self._described_at = frame, time.monotonic()
        pause = max(DESCRIBE, RARELY * (self._described_at - begin))
        # curves are computed once for a motion: how long that takes says nothing of another moment of it
        self._pause, self._pace = (self._pause, pause) if again else (pause, DESCRIBE)


def _quantity(options: DisplayOptions) -> str:
    """What colours show: columns in one place are told apart by their own."""
    return COLOR_BY[0] if options.overlay else options.color_by
