"""Help: for each client alone, and it names every key."""

import pytest

from odeform_figures.viewer_benchmark.client import LoopbackClient
from odeform_viz.app import App
from odeform_viz.panels.help import TABS


def test_help_names_tabs_and_keys(kicked: tuple[App, LoopbackClient]) -> None:
    _, client = kicked
    text = client.text()
    assert all(f"**{tab}**" in text for tab in TABS)
    assert all(f"**{key}**" in text for key in ("Space", "←", "→", *"KJL0POCBGHSR"))


def test_no_key_does_two_things(stubbed: tuple[App, LoopbackClient]) -> None:
    with pytest.raises(ValueError, match="hot key K: expected one that is free"):
        stubbed[0].page.add_hotkey("X K", "nothing", lambda: None)


def test_help_opens_for_who_asks_and_closes_again(kicked: tuple[App, LoopbackClient], port: int) -> None:
    _, client = kicked
    with LoopbackClient(port) as other:
        client.press("Help")
        assert client.until(lambda: "Close" in client.controls)
        other.set("loop", False)  # an answer to it comes after the dialog would have
        assert client.until(lambda: client.controls["loop"].value is False)
        assert "Close" not in other.controls
        client.click("Close")
        assert client.until(lambda: "Close" not in client.controls)
        other.press("Help")
        assert other.until(lambda: "Close" in other.controls)
    client.press("Help")
    assert client.until(lambda: "Close" in client.controls)
    client.press("Help")
    assert client.until(lambda: "Close" not in client.controls)
