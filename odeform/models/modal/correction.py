"""What the mechanics of a trained body leaves unexplained, regressed on the push."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from odeform.models.contact.inputs import ContactInputs
from odeform.models.contact.regression import PARTS, ContactRegression
from odeform.motion.reduced_space import POSE
from odeform.types import Arrays, Floats

__all__ = ["Correction", "kept_of"]


def kept_of(shares: Mapping[str, float], gains: Float[np.ndarray, " coefficients"]) -> Float[np.ndarray, " y"]:
    """(6 + K,) factors of the mechanics' motion, from shares of shift, rotation and deformation and gains (K,)."""
    out = np.concatenate([np.ones(POSE), gains])
    for part, columns in PARTS.items():
        out[columns] *= shares[part]
    return out


class Correction:
    """Kernel regression in the contact's frame of reduced motions of one body, less a share of the mechanics' motion.

    The baseline `gp` is the same regression of whole motions. At rest it is zero.

    Attributes:
        shares: Of the mechanics' shift, rotation and deformation.
        gains: (K,) by which coefficients of the deformation are larger than the mechanics says: soft matter that is
            compressed gives way more than its linear stiffness does, the more so in its stiff modes.
    """

    def __init__(self, arrays: Arrays, settings: Mapping[str, Any]) -> None:
        """From what `odeform.models.modal.training.residual_fit` returns. `KeyError` where something is missing,
        `ValueError` for a share that is none, or for another number of gains than of coefficients."""
        # weaker pushes were not trained, and without one nothing moves
        self._weakest = float(np.linalg.norm(arrays["gp.force"], axis=1).min())
        self._regression, self._times = ContactRegression(arrays, settings), arrays["times"].astype(float)
        # files of before shares or gains were fitted have none
        self.shares = {part: float(settings.get("shares", {}).get(part, 1.0)) for part in PARTS}
        if not all(0.0 <= share <= 1.0 for share in self.shares.values()):
            raise ValueError(f"correction: expected shares from 0 to 1, got {self.shares}")
        coefficients = arrays["gp.modes"].shape[1] // len(self._times)
        self.gains = arrays.get("gains", np.ones(coefficients)).astype(float)
        if self.gains.shape != (coefficients,):
            raise ValueError(f"correction: expected {coefficients} gains, got shape {self.gains.shape}")

    @property
    def kept(self) -> Float[np.ndarray, " y"]:
        """(6 + K,): the factor of each coordinate of the mechanics' motion, to which the regression is added."""
        return kept_of(self.shares, self.gains)

    @property
    def stop(self) -> float:
        """s: the end of the trained window."""
        return float(self._times[-1])

    def over_time(self, push: ContactInputs) -> Callable[[Floats], Float[np.ndarray, "times y"]]:
        """The regression of one push at times (T,) s in the trained window: a cubic spline through its frames."""
        every = self.over_times(push)
        return lambda times: every(times)[0]

    def over_times(self, pushes: ContactInputs) -> Callable[[Floats], Float[np.ndarray, "batch times y"]]:
        """As `over_time`, of B pushes: (T,) s -> (B, T, 6 + K)."""
        share = np.minimum(np.linalg.norm(pushes.force, axis=1) / max(self._weakest, 1e-9), 1.0)
        return CubicSpline(self._times, share[:, None, None] * self._regression.predict(pushes), axis=1)
