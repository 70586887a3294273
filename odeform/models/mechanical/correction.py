"""What the mechanics of a trained body leaves unexplained, regressed on the push."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from odeform.models.contact.inputs import ContactInputs
from odeform.models.contact.regression import ContactRegression
from odeform.types import Arrays, Floats

__all__ = ["Correction"]


class Correction:
    """Adds to reduced motions of one body: kernel regression in the contact's frame, as the baseline `gp` does alone.

    At rest it is zero. Beyond the trained window it keeps its last value, so that the motion there is the mechanics'.
    """

    def __init__(self, arrays: Arrays, settings: Mapping[str, Any]) -> None:
        """From what `fit_contact_regression` returns. `KeyError` where something is missing."""
        # weaker pushes were not trained, and without one nothing moves
        self._weakest = float(np.linalg.norm(arrays["gp.force"], axis=1).min())
        self._regression, self._times = ContactRegression(arrays, settings), arrays["times"].astype(float)

    def over_time(self, push: ContactInputs) -> Callable[[Floats], Float[np.ndarray, "times y"]]:
        """The correction of one push at any times (T,) s: a cubic spline through the trained frames."""
        share = min(float(np.linalg.norm(push.force)) / max(self._weakest, 1e-9), 1.0)
        spline = CubicSpline(self._times, share * self._regression.predict(push)[0])
        return lambda times: spline(np.clip(times, self._times[0], self._times[-1]))
