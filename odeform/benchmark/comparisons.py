"""Other methods at the same task in the same run: learned, classical, another solver, and the simulator itself."""

import itertools
from typing import Any

import numpy as np

from odeform.benchmark.equal_error import simulator
from odeform.benchmark.precision import OperatingPoint
from odeform.benchmark.probes import nearest_sequences, round_cloud, round_mesh
from odeform.benchmark.scipy_solver import scipy_comparison
from odeform.benchmark.timing import milliseconds, typical
from odeform.checkpoint import bundled_checkpoints
from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.evaluation.metrics import evaluate
from odeform.models.base import Predictor
from odeform.models.frontier import EXACT
from odeform.models.model import Model
from odeform.models.points.odeform_per_point import OdeformPerPoint
from odeform.models.reduced_model import ReducedModel
from odeform.models.registry import load
from odeform.motion.reduced_space import motion_rmse
from odeform.solver.integrate import integrate
from odeform.types import Floats, Geometry

__all__ = ["comparisons", "torchdiffeq_comparison"]

FRAMES = 20
PER_POINT = {2_000: 5, 20_000: 2, 100_000: 1}
"""Number of points, and how often the per-point model is timed on them: the last takes most of a minute."""
CHUNK = 2_000  # points per call of the per-point model, so that its activations stay in the cache
POINTS = 5_000
SEQUENCES = 20  # of the test split, for the errors of other checkpoints


def comparisons(
    predictor: Predictor, dataset: Dataset | None, operating_points: list[OperatingPoint]
) -> dict[str, Any]:
    """Measures rows by name: points, frames, ms, speedup of `predictor` over this method, error in mm (None: not
    measured).

    A row with `skipped` gives the reason for no measurement.
    """
    rows = {f"per-point latent ODE, {points:,} points": _per_point(predictor, points) for points in PER_POINT}
    rows |= _checkpoints(predictor, dataset)
    if isinstance(predictor, Model):
        rows["torchdiffeq, same field"] = torchdiffeq_comparison(predictor, operating_points[0])
        rows["SciPy, same field, equal error"] = scipy_comparison(predictor, operating_points[0])
        rows["mujoco, equal error"] = simulator(predictor, dataset)
    return rows


def _motion_ms(predictor: Predictor, shape: Geometry, times: Floats) -> float:
    """Milliseconds from parameters to all frames, with the basis of the shape cached. Per-point models take seconds."""
    repeats, warm = (15, 3) if isinstance(predictor, ReducedModel) else (2, 1)
    return typical(lambda _: predictor.solve(shape, until=float(times[-1])).vertices(times), repeats, warm)


def _times(predictor: Predictor) -> Floats:
    """Consecutive frames at the rate of the data, from the first contact: the start of the impact or of the window."""
    schema = predictor.schema
    first = schema.impact[0] if schema.impact else schema.window.start
    return first + np.arange(FRAMES) / schema.window.rate


def _per_point(predictor: Predictor, points: int) -> dict[str, Any]:
    shape = round_cloud(points, predictor)
    basis = float(milliseconds(lambda _: predictor.solve(shape), 1, warm=0)[0])
    ours = _motion_ms(predictor, shape, _times(predictor))
    theirs = _per_point_ms(points, PER_POINT[points])
    return {
        "points": points,
        "frames": FRAMES,
        "ms": theirs,
        "ours_ms": ours,
        "basis_ms": basis,
        "speedup": theirs / ours,
        "error_mm": None,
        "note": "untrained weights: only its time is measured",
    }


def _per_point_ms(points: int, repeats: int) -> float:
    """The paper's layout: a latent of 128 numbers per point (encoder 64-128-128, field 6 x 256, decoder 128-64).

    RK4 in torch with one step per frame, on chunks of points.
    """
    import torch
    from torch import nn

    def mlp(sizes: list[int], act: type[nn.Module]) -> nn.Sequential:
        layers: list[nn.Module] = []
        for before, after in itertools.pairwise(sizes):
            layers += [nn.Linear(before, after), act()]
        return nn.Sequential(*layers[:-1])

    encode = mlp([41, 64, 128, 128, 128], nn.ReLU)
    field = mlp([128 + 32 + 1, *([256] * 5), 128], nn.Tanh)
    decode = mlp([128, 128, 64, 3], nn.ReLU)
    inputs, conditions = torch.randn(points, 41), torch.randn(points, 33)

    def run(_: int) -> None:
        h = 1.0 / FRAMES
        for chunk, condition in zip(inputs.split(CHUNK), conditions.split(CHUNK), strict=True):
            z = encode(chunk)
            for _ in range(FRAMES - 1):
                k1 = field(torch.cat([z, condition], dim=1))
                k2 = field(torch.cat([z + h / 2 * k1, condition], dim=1))
                k3 = field(torch.cat([z + h / 2 * k2, condition], dim=1))
                k4 = field(torch.cat([z + h * k3, condition], dim=1))
                z = z + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
                decode(z)

    with torch.inference_mode():
        # the smallest warms up torch for all
        return typical(run, repeats, warm=1 if points == min(PER_POINT) else 0)


def _error_mm(predictor: Predictor, dataset: Dataset | None, count: int) -> float | None:
    if dataset is None:
        return None
    near = nearest_sequences(dataset, predictor.schema.complete(None), count)
    return evaluate(predictor, near, "test")["rmse_pooled_mm"]


def _checkpoints(predictor: Predictor, dataset: Dataset | None) -> dict[str, Any]:
    """Every other bundled model of the scene, and this one's own error on the same sequences."""
    shape, times = round_mesh(POINTS, predictor), _times(predictor)
    ours = _motion_ms(predictor, shape, times)

    def row(other: Predictor, ms: float) -> dict[str, Any]:
        error = _error_mm(other, dataset, SEQUENCES)
        return {"points": POINTS, "frames": FRAMES, "ms": ms, "speedup": ms / ours, "error_mm": error}

    rows = {"this model": row(predictor, ours)}
    for name in bundled_checkpoints():
        scene, model = name.split("/")
        if scene == predictor.schema.scene and model != predictor.model:
            try:
                other = load(name)
            except InputError as error:
                rows[model] = {"skipped": str(error)}
                continue
            if other.checkpoint.sha256 == predictor.checkpoint.sha256:
                continue
            if other.schema.needs_observations:
                rows[model] = {"skipped": "interpolates between given frames"}
                continue
            if isinstance(other, OdeformPerPoint):
                rows[model] = {"skipped": "takes minutes: its time is above, its error in `odeform evaluate`"}
                continue
            trained, physics = (c.provenance.get("fixed") for c in (other.checkpoint, predictor.checkpoint))
            if trained != physics:
                rows[model] = {"skipped": "trained on different physics"}
                continue
            rows[model] = row(other, _motion_ms(other, shape, times))
    return rows


def torchdiffeq_comparison(model: Model, point: OperatingPoint) -> dict[str, Any]:
    """torchdiffeq on the same field, with the same method and step or tolerance, at the frames of the window."""
    try:
        import torch
        import torchdiffeq
    except ModuleNotFoundError as error:
        return {"skipped": f"{error.name} is not installed: pip install 'odeform[dev]'"}
    quality, times = model.qualities["balanced"], model.schema.window.times
    theta, evaluated = model.schema.vector(point.parameters), model.evaluate_basis(model.rest, 0.0)
    field, start, decode, *_ = model.problem(theta, evaluated, np.float32)
    # its `rk4` is the 3/8 rule, of the same order and cost; without a step size it steps on the queries (its issue 137)
    options = {} if quality.step is None else {"options": {"step_size": quality.step}}
    tolerance = quality.tolerance or 0.0
    evaluations = 0

    def torch_field(time: Any, state: Any) -> Any:
        nonlocal evaluations
        evaluations += 1
        return torch.from_numpy(field(0.0, state.numpy()))

    def solve() -> Floats:
        asked = torch.from_numpy(times.astype(np.float32))
        with torch.inference_mode():
            states = torchdiffeq.odeint(
                torch_field,
                torch.from_numpy(start),
                asked,
                rtol=0.0,
                atol=tolerance,
                method=quality.method,
                **options,
            )
        return states.numpy()  # pyright: ignore[reportAttributeAccessIssue]

    states = solve()
    taken = evaluations
    exact_field, exact_start, *_ = model.problem(theta, evaluated, np.float64)
    exact = integrate(exact_field, exact_start, EXACT, float(times[-1])).sample(times)
    difference = motion_rmse(decode(times, states)[1:], decode(times, exact)[1:], model.space.gyration_radius)
    theirs = typical(lambda _: solve(), 10, warm=1)
    ours = typical(lambda _: integrate(field, start, quality, float(times[-1])).sample(times), 10)
    return {
        "points": None,
        "frames": len(times),
        "ms": theirs,
        "ours_ms": ours,
        "speedup": theirs / ours,
        "evaluations": taken,
        "error_mm": 1e3 * difference,
        "note": f"{quality.method}, error is the solver's",
    }
