"""Chooses which deformations Rerun shows: the largest changes that fit into a recording of bounded size.

The points that are shown are apart from those that a replay checks: the latter are complete and exact.
"""

__all__ = ["ShownBudget"]

PER_FRAME = 5_000  # bytes; 9 MB in a minute
AT_ONCE = 1_500_000  # bytes that short recordings, and sudden changes, may take
SMALLEST = 1e-4  # m; smaller changes are invisible


class ShownBudget:
    """Shared by all columns of a recording. The less is left, the larger a change has to be."""

    def __init__(self) -> None:
        self._left = float(AT_ONCE)

    def next_frame(self) -> None:
        """Call once per frame."""
        self._left = min(self._left + PER_FRAME, AT_ONCE)

    def allows(self, change: float, size: int) -> bool:
        """Whether points that have moved by at most `change` m are logged again, for `size` bytes, which it counts."""
        if self._left < size or not change >= SMALLEST * AT_ONCE / self._left:
            return False
        self._left -= size
        return True

    def force(self, size: int) -> None:
        """Count `size` bytes that have to be logged."""
        self._left -= size
