"""Makes an error band hold for whole motions: one score a motion, and the quantile of the scores (split conformal)."""

import math

import numpy as np
from jaxtyping import Float

from odeform.types import Floats

__all__ = ["FEWEST", "SCORES", "conformal_factor", "motion_score"]

SCORES = "val.motions"
"""(S,) scores of motions that neither chose the model nor its band; kept in the checkpoint beside it."""
FEWEST = 9
"""Motions from which on there is a 90 % quantile: of fewer, no score is large enough."""
NOTHING = 1e-9  # mm


def motion_score(errors_mm: Floats, band_mm: Floats) -> float:
    """The largest ratio, as a logarithm, of errors (T,) in mm to a band (T,) in mm that is above zero."""
    shown = band_mm > NOTHING
    return float(np.log(np.maximum(errors_mm[shown], NOTHING) / band_mm[shown]).max())


def conformal_factor(scores: Float[np.ndarray, " motions"], nominal: float) -> float | None:
    """By how much to widen a band so that a fraction `nominal` of further motions stay within it throughout.

    Of scores (S,) of motions that are exchangeable with those to come, the one of rank (S + 1) `nominal`, rounded up
    (Vovk et al. 2005; Lei et al. 2018). None where there are too few.
    """
    rank = math.ceil((len(scores) + 1) * nominal - 1e-9)
    if len(scores) < FEWEST or rank > len(scores):
        return None
    return float(np.exp(np.sort(scores)[rank - 1]))
