"""Failures of a simulator."""

__all__ = ["SimulationError"]


class SimulationError(RuntimeError):
    """The simulator warned, diverged or did not finish; the sequence must not be used."""
