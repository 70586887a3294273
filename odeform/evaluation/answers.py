"""Whether a motion is a function of what was asked: of parameters, points and time, and of nothing else."""

import numpy as np

from odeform.evaluation.check import Check, Checks
from odeform.evaluation.draws import inside
from odeform.predictor import Predictor
from odeform.solver.integrate import Quality
from odeform.types import Floats, PointCloud

__all__ = ["check_answers"]

ROUNDING = 1e-6  # m; what single precision rounds coordinates of metres by
DRAWS = 6


def check_answers(predictor: Predictor, seed: int = 0) -> Checks:
    """Any set of queries in any order, repetition, parts of a shape, precision, and sensitivities.

    `sensitivity_relative`: central differences over a fiftieth and a hundredth of the trained range, some steps of a
    slider, the one against the other: sliders move a motion smoothly.
    """
    window, rng = predictor.schema.window, np.random.default_rng(seed)
    times = window.times
    grid = order = again = part = precision = smooth = 0.0
    few = rng.permutation(len(predictor.rest.points))[:50]
    body = PointCloud(np.asarray(predictor.rest.points, dtype=np.float32))
    for parameters in inside(predictor.schema, DRAWS, seed):
        motion = predictor.solve(body, parameters)
        frames = motion.vertices(times)
        shuffled = rng.permutation(len(times))
        grid = max(grid, _apart(motion.vertices(times[shuffled]), frames[shuffled]))
        late = predictor.solve(body, parameters, until=3.0 * window.stop)
        for row in shuffled[:20]:
            one = motion.vertices(float(times[row]))
            grid = max(grid, _apart(one, frames[row]))
            order = max(order, _apart(one, late.vertices(float(times[row]))))
        again = max(again, _apart(predictor.solve(body, parameters).vertices(times), frames))
        some = predictor.solve(PointCloud(body.points[few]), parameters)
        part = max(part, _apart(some.vertices(times), frames[:, few]))
        single, double = (
            predictor.solve(body, parameters, Quality("rk4", step=1.0 / window.rate, dtype=dtype)).vertices(times)
            for dtype in ("float32", "float64")
        )
        precision = max(precision, _apart(single, double))
        smooth = max(smooth, _unevenness(predictor, parameters, times))
    return {
        "grid_invariance_m": Check(grid, ROUNDING),
        "scrub_order_m": Check(order, 0.0),
        "determinism_m": Check(again, 0.0),
        "batch_invariance_m": Check(part, ROUNDING),
        "single_precision_mm": Check(1e3 * precision, 0.1),
        "sensitivity_relative": Check(smooth, 0.05),
    }


def _apart(one: Floats, other: Floats) -> float:
    return float(np.abs(np.subtract(one, other, dtype=float)).max())


def _unevenness(predictor: Predictor, parameters: dict[str, float], times: Floats) -> float:
    """How far central differences of two widths are apart, relative to the larger; the worst parameter."""
    worst, finest = 0.0, Quality("dopri5", tolerance=1e-9, dtype="float64")
    quality = finest if predictor.qualities else "balanced"
    for p in predictor.schema.learned:
        unit, slopes = 0.95 * p.normalise(parameters[p.name]), []
        for width in (0.02, 0.01):
            ends = [
                predictor.solve(None, {**parameters, p.name: p.denormalise(unit + end)}, quality)
                for end in (width, -width)
            ]
            one, other = (end.vertices(times).astype(float) for end in ends)
            slopes.append((one - other) / (2.0 * width))
        size = max(float(np.abs(slope).max()) for slope in slopes)
        worst = max(worst, _apart(*slopes) / size if size else 0.0)
    return worst
