"""Whether a motion depends on parameters, points and time, and on nothing else."""

import numpy as np

from odeform.models.base import Predictor
from odeform.solver.integrate import SolverSettings
from odeform.stress.cases import inside
from odeform.stress.check import Check, Checks
from odeform.types import Floats, PointCloud

__all__ = ["check_consistency"]

ROUNDING = 1e-6  # m; rounding of coordinates of metres in single precision
SAMPLES = 6


def check_consistency(predictor: Predictor, seed: int = 0) -> Checks:
    """Checks that a motion is the same for any set and order of times, repeated solves, parts of a shape, and both
    precisions."""
    window, rng = predictor.schema.window, np.random.default_rng(seed)
    times = window.times
    grid = order = again = part = precision = 0.0
    few = rng.permutation(len(predictor.rest.points))[:50]
    body = PointCloud(np.asarray(predictor.rest.points, dtype=np.float32))
    for parameters in inside(predictor.schema, SAMPLES, seed):
        motion = predictor.solve(body, parameters)
        frames = motion.vertices(times)
        shuffled = rng.permutation(len(times))
        grid = max(grid, _largest_difference(motion.vertices(times[shuffled]), frames[shuffled]))
        late = predictor.solve(body, parameters, until=3.0 * window.stop)
        for row in shuffled[:20]:
            one = motion.vertices(float(times[row]))
            grid = max(grid, _largest_difference(one, frames[row]))
            order = max(order, _largest_difference(one, late.vertices(float(times[row]))))
        again = max(again, _largest_difference(predictor.solve(body, parameters).vertices(times), frames))
        some = predictor.solve(PointCloud(body.points[few]), parameters)
        part = max(part, _largest_difference(some.vertices(times), frames[:, few]))
        single, double = (
            predictor.solve(body, parameters, SolverSettings("rk4", step=1.0 / window.rate, dtype=dtype)).vertices(
                times
            )
            for dtype in ("float32", "float64")
        )
        precision = max(precision, _largest_difference(single, double))
    return {
        "grid_invariance_m": Check(grid, ROUNDING),
        "scrub_order_m": Check(order, 0.0),
        "determinism_m": Check(again, 0.0),
        "batch_invariance_m": Check(part, ROUNDING),
        "single_precision_mm": Check(1e3 * precision, 0.1),
    }


def _largest_difference(one: Floats, other: Floats) -> float:
    return float(np.abs(np.subtract(one, other, dtype=float)).max())
