"""Units of lengths in files that do not say theirs, and bodies whose size makes another one likely."""

import numpy as np

from odeform.types import Points

__all__ = ["METRES", "body_size", "size_doubts"]

METRES = {"m": 1.0, "dm": 0.1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "ft": 0.3048}
USUAL = (5e-3, 5.0)
"""Metres that the bodies of soft-body simulation are large; others make a note."""
LIKELY = (1e-2, 2.5)
"""Metres that a body has in a unit that is proposed."""
PROPOSED = ("mm", "cm", "um")


def body_size(points: Points) -> float:
    """Returns the largest extent of (N, 3) points along an axis, to three digits."""
    return float(f"{np.ptp(points.astype(float), axis=0).max():.3g}")


def size_doubts(size: float, name: str, unit: str) -> list[str]:
    """A note if a body has an unusual size in metres, with the units that would make it usual."""
    if USUAL[0] <= size <= USUAL[1]:
        return []
    stored = size / METRES[unit]
    fitting = [other for other in PROPOSED if other != unit and LIKELY[0] <= stored * METRES[other] <= LIKELY[1]]
    hint = ", ".join(f"with --unit {other} it would be {stored * METRES[other]:.3g} m" for other in fitting)
    taken = "its files are taken to be in metres" if unit == "m" else f"its files are taken to be in {unit}"
    return [f"the body of {name} is {size:.3g} m large: {taken}{'; ' if hint else ''}{hint}"]
