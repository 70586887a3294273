"""What a stress run says of a model: a measured figure, and the bound that a user would need."""

import math
from dataclasses import dataclass
from typing import Any

__all__ = ["Check", "Checks"]


@dataclass(frozen=True)
class Check:
    """`figure` should not exceed `bound`, or should reach it where `at_least`; what is not finite never holds."""

    figure: float | int
    bound: float | int
    at_least: bool = False

    @property
    def holds(self) -> bool:
        return math.isfinite(self.figure) and (
            self.figure >= self.bound if self.at_least else self.figure <= self.bound
        )

    def to_json(self) -> dict[str, Any]:
        return {
            "holds": self.holds,
            "figure": self.figure if math.isfinite(self.figure) else None,
            "bound": self.bound,
        }


Checks = dict[str, Check]
"""By name; the names end in units."""
