"""The error of a figure's model against a recorded motion, at the one place on the sliders where there is one."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.figure.grid import FigureColumn
from odeform.motion.recorded import RecordedMotion
from odeform.motion.truth_errors import DISTANCE, truth_errors
from odeform.types import Times

__all__ = ["TruthError", "truth_error"]


@dataclass(frozen=True, eq=False)
class TruthError:
    """How far a model is from a truth."""

    places: Float[np.ndarray, " sweeps"]
    """(A,) of the truth's parameters on the sliders, from 0 to 1."""
    rms_mm: Times
    """(T,) RMS distance of the vertices, at the frames of the figure; NaN after the end of the truth."""


def truth_error(column: FigureColumn, truth: RecordedMotion) -> TruthError | None:
    """Compares the model of a column with a truth; None where no place on the sliders has the truth's parameters."""
    source, given = column.source, truth.setting
    inside = [s.name in given and s.low <= float(given[s.name]) <= s.high for s in source.sweeps]
    if not all(inside) or source.geometry is not None:
        return None
    places = np.array([sweep.place(float(given[sweep.name])) for sweep in source.sweeps])
    parameters = source.complete(places)
    if not truth.of(parameters):
        return None
    body = source.predictor.to_body_frame(truth.geometry, parameters)
    motion = source.predictor.solve(body, parameters, source.quality)
    return TruthError(places, DISTANCE * truth_errors(motion, truth, column.times)[:, 0])
