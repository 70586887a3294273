"""Regresses what the mechanics of a trained body leaves unexplained on the push."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from odeform.models.contact.inputs import ContactInputs
from odeform.models.contact.regression import ContactRegression
from odeform.models.residual import PARTS, Residual, weight_of
from odeform.types import Arrays, Floats

__all__ = ["PushRegression", "contact_residual"]


@dataclass(frozen=True, eq=False)
class PushRegression:
    """The regression in the contact's frame of reduced motions of one body, less the weighted motion of its mechanics.

    The baseline `gp` is the same regression of whole motions.
    """

    regression: ContactRegression
    scale: Float[np.ndarray, " coefficients"]
    """(K,) by which coefficients of the deformation are larger than the mechanics says: soft matter that is compressed
    gives way more than its linear stiffness does, the more so in its stiff modes."""
    parts: Mapping[str, float]
    """Weights of the mechanics' shift, rotation and deformation."""
    weakest: float
    """N; weaker pushes were not trained, and without one nothing moves."""

    def frames(self, inputs: ContactInputs) -> Floats:
        """(B, T, 6 + K) of B pushes; zero at rest."""
        strength = np.minimum(np.linalg.norm(inputs.force, axis=1) / max(self.weakest, 1e-9), 1.0)
        return strength[:, None, None] * self.regression.predict(inputs)


def contact_residual(arrays: Arrays, settings: Mapping[str, Any]) -> Residual:
    """The residual of a checkpoint, from what `odeform.models.modal.training.residual_fit` returns.

    `KeyError` where something is missing, `ValueError` for a weight that is none, or for another number of scales than
    of coefficients.
    """
    times = arrays["times"].astype(float)
    # files of before weights or scales were fitted have none
    parts = {part: float(settings.get("shares", {}).get(part, 1.0)) for part in PARTS}
    if not all(0.0 <= weight <= 1.0 for weight in parts.values()):
        raise ValueError(f"correction: expected ODE weights from 0 to 1, got {parts}")
    coefficients = arrays["gp.modes"].shape[1] // len(times)
    scale = arrays.get("gains", np.ones(coefficients)).astype(float)
    if scale.shape != (coefficients,):
        raise ValueError(f"correction: expected {coefficients} gains, got shape {scale.shape}")
    weakest = float(np.linalg.norm(arrays["gp.force"], axis=1).min())
    regression = PushRegression(ContactRegression(arrays, settings), scale, parts, weakest)
    return Residual(times, weight_of(parts, scale), regression)
