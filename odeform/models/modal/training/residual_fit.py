"""The residual of a modal model: the weight of each part of the mechanics' motion, and the regression of what that
leaves."""

from typing import Any

import numpy as np
from jaxtyping import Float

from odeform.mechanics.contact_parameters import ContactParameters
from odeform.models.contact.inputs import ContactInputs
from odeform.models.contact.regression import PARTS, fit_contact_regression
from odeform.models.modal.training.contact_fit import FINE
from odeform.models.modal.training.pushes import Pushes
from odeform.motion.reduced_space import POSE
from odeform.types import Arrays, Floats

__all__ = ["WEIGHTS", "fit_contact_residual"]

ENERGY = 0.99  # of the deformations that are left to the residual, in the modes of their trajectories
WEIGHTS = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.25, 0.0)
"""Weights of the mechanics' motion, tried for each part. Without any, a part is the regression of whole motions."""
PRIOR = 0.1  # weight of a scale of one, relative to that of the motions


def fit_contact_residual(
    train: Pushes, val: Pushes, contact_parameters: ContactParameters, pulse: float
) -> tuple[Arrays, dict[str, Any]]:
    """Return arrays and settings of the residual of one body: see `odeform.models.modal.contact_residual`.

    Each coefficient of the deformation has the modal scale of least squares. Shift, rotation and deformation have the
    weight with the smallest squared error on training motions, each predicted from all others, and validation motions
    together.
    """
    known, asked = (ContactInputs(p.contacts, p.normals, p.forces) for p in (train, val))
    motion, motion_val = (p.predicted(contact_parameters, pulse, FINE) for p in (train, val))
    scales = _modal_scales(motion[..., POSE:], train.reduced[..., POSE:])
    motion[..., POSE:] *= scales
    motion_val[..., POSE:] *= scales
    trials = {
        weight: fit_contact_regression(
            known, asked, train.times, train.reduced - weight * motion, val.reduced - weight * motion_val, ENERGY
        )
        for weight in WEIGHTS
    }
    best = {part: min(WEIGHTS, key=lambda weight: trials[weight][1]["errors"][part]) for part in PARTS}
    arrays: Arrays = {"gains": scales.astype(np.float32)}
    arrays |= {key: value for key, value in trials[best["deformation"]][0].items() if not _part_of(key)}
    settings: dict[str, Any] = {"shares": best, "blend": {}, "trials": []}
    for part, weight in best.items():
        found, chosen = trials[weight]
        arrays |= {key: value for key, value in found.items() if _part_of(key) == part}
        settings["blend"][part] = chosen["blend"][part]
        settings["trials"] += [
            {"part": part, "share": tried, "error": result["errors"][part]} for tried, (_, result) in trials.items()
        ]
    return arrays, settings


def _modal_scales(motion: Floats, truth: Floats) -> Float[np.ndarray, " coefficients"]:
    """(K,) of least squares between deformations (S, T, K) by mechanics and in truth, drawn towards one."""
    power = (motion**2).sum(axis=(0, 1))
    prior = PRIOR * power + 1e-4 * power.max() + 1e-30
    return ((motion * truth).sum(axis=(0, 1)) + prior) / (power + prior)


def _part_of(key: str) -> str | None:
    """The part of the motion that an array gp.PART.EXPERT.NAME belongs to; None for those of all parts."""
    name = key.split(".")[1] if key.count(".") > 1 else ""
    return name if name in PARTS else None
