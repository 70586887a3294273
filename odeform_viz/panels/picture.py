"""Downloading what the browser shows: a screenshot, or the motion as a film."""

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future

import numpy as np
import viser

from odeform.errors import InputError
from odeform.formats.picture_files import FFMPEG, Picture, mp4_bytes, png_bytes, webp_bytes
from odeform_viz.export import export_notes
from odeform_viz.page import Page, Panel
from odeform_viz.panels.caption import subject_text
from odeform_viz.picture_caption import captioned, cropped_to_view
from odeform_viz.rendering.framing import free_area
from odeform_viz.view import Description

__all__ = ["PicturePanel"]

RATE, MOST = 25.0, 150  # frames per second of the motion, and of a film
WIDTH = 720  # px; of a film
TIMEOUT = 60.0  # s for one picture: browsers may render in software
POLL = 5e-3  # s
OF_FILM = "the motion until the end of the trained or measured time, from this camera"

File = tuple[str, bytes]
"""A name and its content."""


class PicturePanel(Panel):
    """Two buttons, and the progress of a film. The browser that asks draws it, from its own camera."""

    def __init__(self, page: Page) -> None:
        self._page, gui = page, page.server.gui
        self._lock, self._busy, self._cancelled = threading.Lock(), False, threading.Event()
        self._described: Description | None = None
        with gui.add_folder("Picture"):
            self._shot = gui.add_button("Screenshot (.png)", color="gray", hint="the bodies, with a caption")
            self._shot.on_click(lambda event: self._run(event.client, self._screenshot))
            self._film = gui.add_button("Film (.webp)", color="gray", hint=OF_FILM)
            self._film.on_click(lambda event: self._run(event.client, self._record))
            self._mp4 = gui.add_button("Film (.mp4)", color="gray", visible=bool(FFMPEG), hint=OF_FILM)
            self._mp4.on_click(lambda event: self._run(event.client, lambda client: self._record(client, ".mp4")))
            self._bar = gui.add_progress_bar(0.0, visible=False)
            self._cancel = gui.add_button("Cancel the film", color="gray", visible=False)
            self._cancel.on_click(lambda _: self._cancelled.set())

    def close(self) -> None:
        """End a film in progress."""
        self._cancelled.set()

    def _run(self, client: viser.ClientHandle | None, action: Callable[[viser.ClientHandle], File | None]) -> None:
        if client is None or not self._begin():
            return
        file = None
        try:
            file = action(client)
        except (InputError, OSError, RuntimeError) as error:  # a closed tab, or one in the background, draws nothing
            self._page.notices.show("No picture", str(error))
        finally:
            self._end()
        if file is not None:  # only now: whoever has it may ask for the next one
            client.send_file_download(*file, save_immediately=True)

    def _begin(self) -> bool:
        """Whether nothing else was in progress."""
        with self._lock:
            began = not self._busy
            if began:
                self._busy = True
                self._cancelled.clear()
            return began

    def _end(self) -> None:
        with self._lock:  # a click on the button that appears waits until it can be answered
            self._bar.visible = self._cancel.visible = False
            self._film.visible, self._mp4.visible = True, bool(FFMPEG)
            self._busy = False

    def _screenshot(self, client: viser.ClientHandle) -> File:
        picture = self._captioned(client, 1.0)
        notes = export_notes(self._page.session, self._page.request(), whole=False)
        return "screenshot.png", png_bytes(picture, notes)

    def _record(self, client: viser.ClientHandle, suffix: str = ".webp") -> File | None:
        page, window, camera = self._page, self._page.schema.window, client.camera
        length = window.stop - window.start
        times = np.linspace(window.start, window.stop, min(max(round(RATE * length), 2), MOST))
        left, _, right, _ = free_area((camera.image_width, camera.image_height))
        factor = min(WIDTH / max(right - left, 1.0), 1.0)
        began, playing = page.clock.time(), page.clock.playing
        self._bar.value, self._film.visible, self._mp4.visible = 0.0, False, False
        self._bar.visible = self._cancel.visible = True
        pictures = []
        try:
            for number, moment in enumerate(times):
                if not self._go_to(float(moment)):
                    return None
                pictures.append(self._captioned(client, factor))
                self._bar.value = 100.0 * (number + 1) / len(times)
        finally:
            page.pause_at(began)
            if playing:
                page.clock.play()
                page.wake()
        notes = export_notes(page.session, page.request(), whole=True)
        bytes_of = webp_bytes if suffix == ".webp" else mp4_bytes
        return f"motion{suffix}", bytes_of(pictures, length / (len(times) - 1), notes)

    def _captioned(self, client: viser.ClientHandle, factor: float) -> Picture:
        """What the client sees between the panels, `factor` times as large, with a caption."""
        viewport = client.camera.image_width, client.camera.image_height
        width, height = (max(round(factor * side), 1) for side in viewport)
        picture = cropped_to_view(_draw(client, width, height), viewport)
        frame, described = self._page.shown(), self._described
        if frame is None:
            return picture
        return captioned(picture, subject_text(frame), frame.request.time, described.scale if described else None)

    def describe(self, description: Description) -> None:
        self._described = description

    def _go_to(self, moment: float) -> bool:
        """Show `moment` in seconds with all columns; false if the film was cancelled."""
        page, end = self._page, time.monotonic() + TIMEOUT
        page.pause_at(moment)
        while not self._cancelled.is_set():
            frame = page.shown()
            if frame is not None and not frame.pending and abs(frame.request.time - moment) < 1e-6:
                return True
            if page.clock.playing or abs(page.clock.time() - moment) > 1e-6:
                raise InputError("the time was changed while the film was made")
            if time.monotonic() > end:
                raise InputError(f"t = {moment:.3f} s was not shown within {TIMEOUT:g} s")
            time.sleep(POLL)
        return False


def _draw(client: viser.ClientHandle, width: int, height: int) -> Picture:
    # coloured meshes are decoded by the browser while it goes on: the first picture may show the one before
    _render(client, 16, 16)
    return _render(client, width, height)


def _render(client: viser.ClientHandle, width: int, height: int) -> Picture:
    """Asks the browser for what it draws. `InputError` if it takes too long; viser's own limit is one of the wall
    clock, which may jump."""
    drawn: Future[Picture] = Future()

    def render() -> None:
        try:
            drawn.set_result(np.asarray(client.get_render(height, width))[..., :3])
        except Exception as error:
            drawn.set_exception(error)

    threading.Thread(target=render, name="odeform-picture", daemon=True).start()
    try:
        return drawn.result(TIMEOUT)
    except TimeoutError:
        raise InputError(f"the browser has drawn nothing within {TIMEOUT:g} s") from None
