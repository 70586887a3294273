"""Notifications reach every client, once."""

from types import SimpleNamespace
from typing import Any

from odeform_viz.runtime.notices import Notices


class FakeServer:
    """Two clients that keep the messages of their notifications."""

    def __init__(self) -> None:
        self.messages: list[str] = []

    def get_clients(self) -> dict[int, Any]:
        client = SimpleNamespace(add_notification=lambda title, body, **_: self.messages.append(body))
        return {0: client, 1: client}


def test_a_repeated_message_is_shown_once_to_each_client() -> None:
    server = FakeServer()
    notices = Notices(server)  # pyright: ignore[reportArgumentType]
    for message in ("no such file", "no such file", "no such model"):
        notices.show("Not opened", message)
    assert server.messages == ["no such file"] * 2 + ["no such model"] * 2
