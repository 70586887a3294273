"""How the field of a model amplifies small differences, and whether the reported errors and derivatives are right."""

import math

import numpy as np
from scipy.stats import rankdata

from odeform.models.latent.model import LatentModel
from odeform.models.model import Model
from odeform.motion.reduced_motion import as_reduced
from odeform.motion.reduced_space import POSE, motion_rmse, small_motion
from odeform.schema import LATER
from odeform.solver.integrate import SolverSettings, integrate
from odeform.solver.method import Field
from odeform.stress.cases import inside, methods_of, random_quality
from odeform.stress.check import Check, Checks
from odeform.types import Floats

__all__ = ["check_calibration", "check_field", "check_sensitivities"]

TRUTH = SolverSettings("dopri5", tolerance=1e-11, dtype="float64")
CALIBRATION = (24, 9)  # motions, and random solver settings for each
SAMPLES = 2
HALF_STEP = 0.005  # in halves of the trained range: half a slider step of 1/200 of the range


def check_field(model: Model, seed: int = 0) -> Checks:
    """Returns the growth of differences and of the state.

    `lyapunov_per_s`: largest finite-time Lyapunov exponent over the window, from the derivative of the final state by
    the initial one; the bound lets rounding in single precision grow to a thousandth. `state_growth`: largest latent
    value at any time, late ones included, over the largest within the window. `until_divergence_unbounded_windows`:
    windows until the deformation would exceed twice the largest within the window if the clock did not stop; it has to
    stay below that until the clock stops.
    """
    evaluated, schema = model.evaluate_basis(model.rest, 0.0), model.schema
    window, step = schema.window, SolverSettings("rk4", step=1.0 / schema.window.rate)
    # a continued motion does not use later states
    last = window.stop if window.reach else float(window.soft_clamped(np.array(10.0 * window.stop)))
    exponent, within, ever, by = -math.inf, 0.0, 0.0, 1e-6
    for parameters in inside(schema, SAMPLES, seed):
        field, start, *_ = model.problem(model.inputs(parameters), evaluated, np.float64)

        def end(at: Floats, field: Field = field) -> Floats:
            return integrate(field, at, step, window.stop).at(window.stop)

        moved = np.stack([end(start + by * unit) for unit in np.eye(len(start))]) - end(start)
        exponent = max(exponent, math.log(np.linalg.norm(moved / by, 2)) / window.stop)
        states = integrate(field, start, step, last)
        sizes = np.abs(states.states).max(axis=1)
        within = max(within, float(sizes[np.array(states.times) <= window.stop].max()))
        ever = max(ever, float(sizes.max()))
    allowed = math.log(1e-3 / float(np.finfo(np.float32).eps)) / window.stop
    return {
        "lyapunov_per_s": Check(exponent, allowed),
        "state_growth": Check(ever / within, 2.0),
        "until_divergence_unbounded_windows": Check(
            _divergence(model, seed), 1.0 + window.reach + LATER, at_least=True
        ),
    }


def _divergence(model: Model, seed: int) -> float:
    """Windows (at most 10) until a motion of the trained box deforms by more than twice the largest in the window."""
    schema, step = model.schema, SolverSettings("rk4", step=1.0 / model.schema.window.rate, dtype="float64")
    times = schema.window.stop * np.linspace(0.0, 10.0, 1001)
    sampled = inside(schema, 4 * SAMPLES, seed)
    motions = [as_reduced(model.solve(None, parameters, step)).trajectory.reduced(times) for parameters in sampled]
    deformed = np.max([np.linalg.norm(y[:, POSE:], axis=1) for y in motions], axis=0)
    diverged = deformed > 2.0 * deformed[times <= schema.window.stop].max()
    return float(times[diverged.argmax() if diverged.any() else -1] / schema.window.stop)


def check_calibration(model: Model, seed: int = 0) -> Checks:
    """Reported solver errors against those measured with tolerance 1e-11: their rank correlation (Spearman), and the
    fraction of solves in which they are within a factor of 2.

    Half of the motions are inside the trained box, the others up to ten times beyond it. Settings are the model's
    qualities and random ones; solves without an estimate are left out. `..._inside` counts the trained box alone.
    """
    evaluated, schema = model.evaluate_basis(model.rest, 0.0), model.schema
    rng, stop = np.random.default_rng(seed), schema.window.stop
    times = np.linspace(0.0, stop, 129)[1:]
    rows = []
    for index in range(CALIBRATION[0]):
        scale = (1.0, 1.5, 1.0, 10.0)[index % 4]
        theta = model.inputs(inside(schema, 1, seed + index, scale)[0])
        truth = model.integrate(theta, evaluated, TRUTH, stop).reduced(times)
        for quality in (
            *model.qualities.values(),
            *(random_quality(rng, stop, methods_of(model)) for _ in range(CALIBRATION[1])),
        ):
            motion = model.integrate(theta, evaluated, quality, stop)
            reported = motion.stats.solver_error_mm
            if reported is not None:
                true = 1e3 * motion_rmse(motion.reduced(times), truth, model.space.gyration_radius)
                rows.append((scale == 1.0, reported, true))
    within, *both = np.array(rows).T
    near = np.abs(np.log2(np.divide(*both))) <= 1.0
    return {
        "solver_error_rank_correlation": Check(_rank_correlation(*both), 0.9, at_least=True),
        "solver_error_within_factor_2": Check(float(near.mean()), 0.9, at_least=True),
        "solver_error_rank_correlation_inside": Check(
            _rank_correlation(*(values[within > 0.0] for values in both)), 0.9, at_least=True
        ),
        "solver_error_within_factor_2_inside": Check(float(near[within > 0.0].mean()), 0.9, at_least=True),
    }


def _rank_correlation(one: Floats, other: Floats) -> float:
    return float(np.corrcoef(rankdata(one), rankdata(other))[0, 1])


def check_sensitivities(model: LatentModel, seed: int = 0) -> Checks:
    """`sensitivity_relative`: derivatives by the parameters, from the ODE, against central differences over a slider
    step; relative to the largest in the window, for the worst parameter, pose and deformation together."""
    evaluated, schema = model.evaluate_basis(model.rest, 0.0), model.schema
    finest = SolverSettings("dopri5", tolerance=1e-9, dtype="float64")
    times, worst = schema.window.times, 0.0

    def ends(theta: Floats) -> Floats:
        return model.trajectory(theta, evaluated, finest, schema.window.stop).reduced(times)

    for parameters in inside(schema, SAMPLES, seed):
        theta = schema.inputs(parameters)
        derivatives = model.sensitivities(theta, times, finest)[1:]
        for unit, exact in zip(np.eye(len(theta)), derivatives, strict=True):
            by = HALF_STEP * unit
            difference = (ends(theta + by) - ends(theta - by)) / (2.0 * HALF_STEP) - exact
            largest = small_motion(exact, model.space.gyration_radius).max()
            worst = max(worst, float(small_motion(difference, model.space.gyration_radius).max() / largest))
    return {"sensitivity_relative": Check(worst, 0.05)}
