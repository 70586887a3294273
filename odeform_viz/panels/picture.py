"""Downloading what the browser shows: a screenshot, or the motion as a film."""

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future

import numpy as np
import viser

from odeform.errors import InputError
from odeform.formats.picture_files import Picture, png_bytes, webp_bytes
from odeform_viz.export import export_notes
from odeform_viz.page import Page, Panel

__all__ = ["PicturePanel"]

RATE, MOST = 25.0, 150  # frames per second of the motion, and of a film
WIDTH = 720  # px; of a film
TIMEOUT = 60.0  # s for one picture: browsers may render in software
POLL = 5e-3  # s

File = tuple[str, bytes]
"""A name and its content."""


class PicturePanel(Panel):
    """Two buttons, and the progress of a film. The browser that asks draws it, from its own camera."""

    def __init__(self, page: Page) -> None:
        self._page, gui = page, page.server.gui
        self._lock, self._busy, self._cancelled = threading.Lock(), False, threading.Event()
        with gui.add_folder("Picture"):
            self._shot = gui.add_button("Screenshot (.png)", color="gray", hint="the viewport, without panels")
            self._shot.on_click(lambda event: self._run(event.client, self._screenshot))
            self._film = gui.add_button("Film (.webp)", color="gray", hint="the trained window, from this camera")
            self._film.on_click(lambda event: self._run(event.client, self._record))
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
            self._film.visible = True
            self._busy = False

    def _screenshot(self, client: viser.ClientHandle) -> File:
        camera = client.camera
        picture = _draw(client, camera.image_width, camera.image_height)
        notes = export_notes(self._page.session, self._page.request(), whole=False)
        return "screenshot.png", png_bytes(picture, notes)

    def _record(self, client: viser.ClientHandle) -> File | None:
        page, window, camera = self._page, self._page.schema.window, client.camera
        length = window.stop - window.start
        times = np.linspace(window.start, window.stop, min(max(round(RATE * length), 2), MOST))
        width = min(WIDTH, camera.image_width)
        height = max(round(width * camera.image_height / camera.image_width), 1)
        began, playing = page.clock.time(), page.clock.playing
        self._bar.value, self._film.visible = 0.0, False
        self._bar.visible = self._cancel.visible = True
        pictures = []
        try:
            for number, moment in enumerate(times):
                if not self._go_to(float(moment)):
                    return None
                pictures.append(_draw(client, width, height))
                self._bar.value = 100.0 * (number + 1) / len(times)
        finally:
            page.pause_at(began)
            if playing:
                page.clock.play()
                page.wake()
        notes = export_notes(page.session, page.request(), whole=True)
        return "motion.webp", webp_bytes(pictures, length / (len(times) - 1), notes)

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
