"""Visits: browsers that open the page and leave at once, while others drag."""

from odeform_figures.viewer_benchmark.visitors import Visitors

__all__ = ["come_and_go"]

VISITS = 5


def come_and_go(visitors: Visitors) -> None:
    """Each visitor changes something on the way; afterwards none is left."""
    for _ in range(VISITS):
        with visitors.another() as client:
            visitors.drag(client, 3)
            client.set("time (s)", float(visitors.rng.uniform(0.0, client.controls["time (s)"].props["max"])))
        visitors.drag(visitors.first, 3)
    stay = len(visitors.clients)
    visitors.expect(f"{stay} connections", lambda: len(visitors.app.server.get_clients()) == stay)
