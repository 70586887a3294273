"""States of the page: saved, left and restored."""

import json

from odeform_figures.viewer_benchmark.visitors import Visitors, slider_of

__all__ = ["save_and_restore"]


def save_and_restore(visitors: Visitors) -> None:
    """Save a pinned column with other settings, change everything, and restore it from the other browser."""
    app, client = visitors.app, visitors.first
    visitors.drag(client, 3)
    client.click("Pin these parameters")
    client.set("quality", "draft")
    visitors.expect("a pinned column", lambda: any(c.pinned for c in app.columns.all))
    visitors.expect("the quality draft", lambda: app.request().quality == "draft")
    client.downloads.clear()  # an earlier state would be taken for this one
    client.click("Save state")
    visitors.expect("a saved state", lambda: bool(client.downloaded(".json")))
    saved = client.downloaded(".json") or b""
    client.downloads.clear()
    client.set("quality", "balanced")
    client.set(slider_of(app), client.controls[slider_of(app)].props["min"])
    visitors.expect("a changed page", lambda: not _same(app.page.save(), saved))
    visitors.second.upload("Restore state", "state.json", saved)
    visitors.expect("the saved state", lambda: _same(app.page.save(), saved))


def _same(one: bytes, other: bytes) -> bool:
    """Whether two states are the same, but for the camera, of which each browser has its own."""
    states = [{**json.loads(state), "camera": None} for state in (one, other)]
    return states[0] == states[1]
