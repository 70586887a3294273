"""Columns: other models, pinned copies, a sweep, colours, hidden and removed."""

from odeform.models.titles import family_title
from odeform_figures.viewer_benchmark.visitors import Visitors

__all__ = ["compare"]

FAST = [family_title(name) for name in ("odeform", "pod-rbf", "gp", "nearest")]
"""Others move each point separately, and take seconds."""


def compare(visitors: Visitors) -> None:
    """Add a model, a copy and a sweep, look at them in other colours, and remove them again."""
    app, client, rng = visitors.app, visitors.first, visitors.rng
    before = len(app.columns.all)
    models = [m for m in client.controls["model"].props["options"] if m in FAST]
    client.set("model", str(rng.choice(models)))
    client.click("Add model")
    visitors.expect("a column of the added model", lambda: len(app.columns.all) == before + 1)
    client.click("Pin these parameters")
    visitors.expect("a pinned column", lambda: len(app.columns.all) == before + 2)
    visitors.drag(visitors.second, 10)
    for color in ("displacement", "strain", "own colours"):
        client.set("colour by", color)
        visitors.collect(0.3)
    client.set("parameter", client.controls["parameter"].props["options"][0])
    visitors.collect(0.3)
    client.click("Sweep it")
    visitors.expect("the columns of a sweep", lambda: len(app.columns.all) > before + 2)
    client.set("overlay", True)
    visitors.drag(client, 10)
    visitors.expect("the overlay in both browsers", lambda: all(c.controls["overlay"].value for c in visitors.clients))
    client.set("overlay", False)
    visitors.expect_control("Remove hidden columns")
    visitors.second.click("Remove hidden columns")
    visitors.expect("no hidden column but the model", lambda: all(c.visible for c in app.columns.all[1:]))
