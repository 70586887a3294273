"""Numbers that choose the length of the next step; the same for one problem, for many, and for compiled loops."""

__all__ = ["GAINS", "GROW", "MAX_STEPS", "SAFETY", "SHRINK"]

MAX_STEPS = 20_000
SAFETY, SHRINK, GROW = 0.9, 0.2, 5.0
GAINS = 0.7, 0.4
"""Exponents of the errors of this step and the last one, times the order (Gustafsson 1991, ACM TOMS 17(4)), of methods
without gains of their own. Without the last one, a third of the steps into a landing were rejected."""
