"""A trajectory that is made of another."""

from odeform.motion.base import SolveStats
from odeform.motion.reduced_motion import Trajectory

__all__ = ["ChangedTrajectory"]


class ChangedTrajectory:
    """Is computed as `own` is, and valid for as long. A subclass says what its coordinates are."""

    def __init__(self, own: Trajectory) -> None:
        self.own = own

    @property
    def stats(self) -> SolveStats:
        """How `own` was computed."""
        return self.own.stats

    @property
    def last_good(self) -> float:
        """Seconds up to which `own` is valid."""
        return self.own.last_good
