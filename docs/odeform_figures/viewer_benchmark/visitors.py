"""Several browsers on one page, which all read what the viewer sends at any time."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from odeform_figures.viewer_benchmark.client import DEADLINE, LoopbackClient
from odeform_viz.app import App

__all__ = ["Missed", "Visitors"]

TURN = 0.02  # s for which one client reads while the others wait


class Missed(Exception):
    """Something that had to appear on the page did not."""


class Visitors:
    """Two clients that stay, and others that come and go. `folder` is the workspace of the app."""

    def __init__(self, app: App, clients: Sequence[LoopbackClient], folder: Path, rng: np.random.Generator) -> None:
        self.app, self.clients, self.folder, self.rng = app, list(clients), folder, rng
        self.sent = 0
        """Messages sent by clients that have left."""
        self._heard = 0
        self._refusals: list[str] = []

    @property
    def first(self) -> LoopbackClient:
        """The client that most requests come from."""
        return self.clients[0]

    @property
    def second(self) -> LoopbackClient:
        """Another one that stays."""
        return self.clients[1]

    def collect(self, seconds: float) -> None:
        """Let all clients receive for `seconds`."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            for client in self.clients:
                client.receive(min(TURN, max(end - time.monotonic(), 0.0)))

    def expect(self, what: str, holds: Callable[[], bool], seconds: float = DEADLINE) -> None:
        """Let all clients receive until a condition holds. `Missed` with `what` if it does not in time."""
        end = time.monotonic() + seconds
        while not holds():
            if time.monotonic() > end:
                raise Missed(f"expected within {seconds:g} s: {what}")
            self.collect(TURN)

    def expect_control(self, label: str) -> None:
        """Wait until a control can be used in all browsers."""

        def usable() -> bool:
            found = [client.controls.get(label) for client in self.clients]
            return all(c is not None and c.visible and not c.props.get("disabled") for c in found)

        self.expect(f"the control {label!r}", usable)

    def begin(self) -> None:
        """Forget the notifications so far; see `unexpected`."""
        self._heard, self._refusals = len(self.first.notifications), []

    def allow(self, part: str) -> None:
        """Take notifications that contain `part` as expected."""
        self._refusals.append(part)

    def expect_refusal(self, part: str) -> None:
        """Wait for a notification in the first browser that contains `part`."""
        self.allow(part)
        self.expect(f"a notification with {part!r}", lambda: any(part in said for said in self._new()))

    def unexpected(self) -> list[str]:
        """Notifications since `begin` that nothing has provoked."""
        return [said for said in self._new() if not any(part in said for part in self._refusals)]

    def _new(self) -> list[str]:
        return self.first.notifications[self._heard :]

    def drag(self, client: LoopbackClient, count: int, rate: float = 20.0) -> None:
        """Move a slider to `count` random values; `rate` in Hz."""
        label = slider_of(self.app)
        for _ in range(count):
            props = client.controls[label].props
            client.set(label, float(self.rng.uniform(props["min"], props["max"])))
            self.collect(1.0 / rate)

    @contextmanager
    def another(self) -> Iterator[LoopbackClient]:
        """One more browser, which closes its tab at the end, or is killed."""
        client = LoopbackClient(self.app.server.get_port())
        self.clients.append(client)
        try:
            yield client
        finally:
            self.clients.remove(client)
            self.sent += client.sent
            leave = client.vanish if self.rng.random() < 0.5 else client.close
            leave()


def slider_of(app: App) -> str:
    """The label of a slider that changes the motion."""
    return "force (N)" if app.session.schema.objects else app.session.schema.parameters[0].label
