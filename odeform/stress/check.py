"""A check of a stress run: a measured figure and the bound that a user needs."""

import math
from dataclasses import dataclass
from typing import Any

__all__ = ["Check", "Checks"]


@dataclass(frozen=True)
class Check:
    """`figure` should be at most `bound`, or at least `bound` if `at_least`; non-finite figures never hold."""

    figure: float | int
    bound: float | int
    at_least: bool = False

    @property
    def holds(self) -> bool:
        """Whether the figure keeps its bound."""
        kept = self.figure >= self.bound if self.at_least else self.figure <= self.bound
        return math.isfinite(self.figure) and bool(kept)  # no boolean of NumPy, which JSON has no word for

    def to_json(self) -> dict[str, Any]:
        """Returns `holds`, `figure` (None: not finite) and `bound`."""
        return {
            "holds": self.holds,
            "figure": self.figure if math.isfinite(self.figure) else None,
            "bound": self.bound,
        }


Checks = dict[str, Check]
"""Checks by name; the names end in units."""
