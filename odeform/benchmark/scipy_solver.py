"""SciPy's solvers on the same field, each at the loosest tolerance with which it is as exact as ours."""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from odeform.benchmark.precision import OperatingPoint
from odeform.benchmark.timing import typical
from odeform.models.frontier import EXACT
from odeform.models.model import Model
from odeform.motion.reduced_space import motion_rmse
from odeform.solver.integrate import integrate
from odeform.types import Floats

__all__ = ["loosest", "scipy_comparison"]

METHODS = ("RK23", "RK45", "DOP853", "LSODA")
TOLERANCES = tuple(float(x) for x in np.geomspace(1e-2, 1e-9, 15))
"""From loose to tight, of the absolute error; there is no relative one, as in our solvers."""
SMALLEST = 3e-14
"""The relative tolerance that SciPy takes for none."""
REPEATS = 10


def loosest(error_at: Callable[[float], float], wanted: float) -> float | None:
    """Returns the first of `TOLERANCES` at which the error is no more than wanted; None where there is none."""
    return next((tolerance for tolerance in TOLERANCES if error_at(tolerance) <= wanted), None)


def scipy_comparison(model: Model, point: OperatingPoint) -> dict[str, Any]:
    """The fastest of SciPy's methods with at most the error of *balanced*, at the frames of the window."""
    quality, times = model.qualities["balanced"], model.schema.window.times
    theta, evaluated = model.schema.vector(point.parameters), model.evaluate_basis(model.rest, 0.0)
    field, start, decode, *_ = model.problem(theta, evaluated, np.float64)
    exact = decode(times, integrate(field, start, EXACT, float(times[-1])).sample(times))

    def error_mm(states: Floats) -> float:
        return 1e3 * motion_rmse(decode(times, states)[1:], exact[1:], model.space.gyration_radius)

    def ours() -> Floats:
        return integrate(field, start, quality, float(times[-1])).sample(times)

    def theirs(method: str, tolerance: float) -> Floats:
        span = (float(times[0]), float(times[-1]))
        found = solve_ivp(field, span, start, method, times, rtol=SMALLEST, atol=tolerance)
        return found.y.T if found.success else np.full((len(times), len(start)), np.inf)

    our_ms, wanted = typical(lambda _: ours(), REPEATS), error_mm(ours())
    rows = []
    for method in METHODS:
        tolerance = loosest(lambda tried, method=method: error_mm(theirs(method, tried)), wanted)
        if tolerance is not None:
            ms = typical(lambda _, m=method, t=tolerance: theirs(m, t), REPEATS, warm=1)
            rows.append((ms, method, tolerance, error_mm(theirs(method, tolerance))))
    if not rows:
        return {"skipped": f"no method has at most {wanted:.2g} mm"}
    ms, method, tolerance, error = min(rows)
    note = f"{method}, tolerance {tolerance:.1g}; ours has {wanted:.2g} mm"
    return {"points": None, "frames": len(times), "ms": ms, "ours_ms": our_ms, "speedup": ms / our_ms,
            "error_mm": error, "note": note}  # fmt: skip
