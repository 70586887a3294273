"""Records what predictors solve, so that it can be pickled: a motion is solved again from what it was made of."""

from typing import TYPE_CHECKING, Any

from odeform.motion.base import Motion
from odeform.motion.motion_batch import MotionBatch
from odeform.schema import Parameters
from odeform.solver.integrate import SolverSettings
from odeform.types import Geometry, MotionSequence

if TYPE_CHECKING:
    from odeform.models.base import Predictor

__all__ = ["solved", "solved_batch"]


def solved(
    predictor: "Predictor",
    geometry: Geometry,
    parameters: Parameters,
    settings: SolverSettings | None,
    until: float,
    observed: MotionSequence | None = None,
) -> Motion:
    """The motion that `predictor` solves for what `Predictor.solve` fills in; pickled, it is solved again."""
    motion = predictor._solve(geometry, parameters, settings, until, observed)
    given = (predictor, geometry, parameters, settings, until, observed)
    object.__setattr__(motion, "made_by", (solved, given))  # motions are frozen
    return motion


def solved_batch(
    predictor: "Predictor",
    geometry: Geometry,
    sets: list[dict[str, Any]],
    settings: SolverSettings | None,
    until: float,
) -> MotionBatch:
    """The motions that `predictor` solves for what `Predictor.solve_batch` fills in; pickled, they are solved again."""
    batch = predictor._solve_batch(geometry, sets, settings, until)
    batch.made_by = solved_batch, (predictor, geometry, sets, settings, until)
    return batch
