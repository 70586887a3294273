"""How far motions of falling bodies were found to be off: the figures of `docs/loads.md`, in the package."""

import json
from functools import cache

from odeform.io import bundled

__all__ = ["FALLS", "error_after_contact"]

FALLS = {"drop": "drops", "throw": "throws"}
"""The loads under which bodies fall on the floor, for which contacts were fitted together; and their figures."""


def error_after_contact(body: str) -> float:
    """RMS distance from simulations over the first 120 ms of contact, relative to the RMS displacement since then.

    The mean over all drops and throws of an object that were measured; for another body the mean over the objects.
    """
    errors = _errors()
    return errors.get(body, sum(errors.values()) / len(errors))


@cache
def _errors() -> dict[str, float]:
    measured = json.loads((bundled("studies") / "loads.json").read_text())
    out = {}
    for name in measured[FALLS["drop"]]:
        rows = [measured[key][name] for key in FALLS.values()]
        motions = sum(row["motions"] for row in rows)
        out[name] = sum(row["motions"] * row["model"]["first_120_ms"] for row in rows) / motions
    return out
