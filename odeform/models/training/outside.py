"""How a band of errors widens outside of the trained ranges: as the errors of simulated motions there do."""

import numpy as np
from jaxtyping import Float
from scipy.optimize import nnls

from odeform.models.conformal import conformal_factor
from odeform.models.error_band import NOMINAL, excess_of
from odeform.types import Floats

__all__ = ["growth_of_stronger", "growth_outside"]

RIDGE = 0.2  # half ranges; what few motions say of one side is chance
WIDER = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0)  # times the growth of the mean, to choose from


def growth_outside(
    theta: Float[np.ndarray, "motions parameters"],
    rmse: Float[np.ndarray, "motions times"],
    bands: Float[np.ndarray, "motions times 2"],
) -> Float[np.ndarray, "2 parameters"]:
    """Returns the growth that `odeform.models.error_band.OUTSIDE` names, from motions outside of the trained ranges.

    `theta` are their normalised parameters, `rmse` their errors in mm at times after 0, and `bands` those of the
    nearest trained parameters. The growth of each side is fitted to the errors' root mean squares, and is none where
    they do not grow; then all are widened until a fraction `NOMINAL` of all errors is covered.
    """
    excess = excess_of(theta).reshape(len(theta), -1)
    grown = np.log(_rms(rmse) / _rms(bands[..., 0]))
    matrix = np.concatenate([excess, RIDGE * np.eye(excess.shape[1])])
    growth, _ = nnls(matrix, np.concatenate([np.maximum(grown, 0.0), np.zeros(excess.shape[1])]))

    def covered(times: float) -> float:
        return float((rmse <= bands[..., 1] * np.exp(times * excess @ growth)[:, None]).mean())

    wider = next((times for times in WIDER if covered(times) >= NOMINAL), WIDER[-1])
    return wider * growth.reshape(2, -1)


def growth_of_stronger(
    stronger: Float[np.ndarray, " motions"], scores: Float[np.ndarray, " motions"]
) -> Float[np.ndarray, ""]:
    """Returns the growth that `odeform.models.error_band.STRONGER` names, which is enough for `NOMINAL` of the motions.

    `stronger` says how much stronger each push is, and `scores` how far its motion leaves the band of the strongest
    in training (`odeform.models.conformal.motion_score`). `ValueError` for too few motions.
    """
    factor = conformal_factor(np.maximum(scores, 0.0) / stronger, NOMINAL)
    if factor is None:
        raise ValueError(f"expected more motions than {len(scores)}")
    return np.array(np.log(factor))


def _rms(values: Float[np.ndarray, "motions times"]) -> Floats:
    return np.sqrt(np.square(values).mean(axis=1))
