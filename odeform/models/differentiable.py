"""Predicted points as tensors of PyTorch, which know how they change with the parameters and the points at rest.

A model of reduced coordinates (`odeform.motion.reduced_space`) moves points by

    P(t) = anchor + Rz(a) [ R(w) (x + sum_k c_k phi_k(x)) + p ],   x = Rz(-a) (P0 - anchor),   y(t; u) = [p, w, c].

PyTorch differentiates this formula. It is told two derivatives: that of y by the normalised parameters u, which is
exact for a family with sensitivities and else comes from central differences of accurate solutions, and that of the
modes phi by the points (`DisplacementBasis.slopes`). Models that move each point by itself are differentiated as a
whole, by central differences in single precision.
"""

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, Protocol, cast, runtime_checkable

import numpy as np
import torch
from torch.autograd.function import once_differentiable

from odeform.errors import InputError
from odeform.models.base import Predictor
from odeform.motion.base import Motion, checked_times
from odeform.motion.basis import DisplacementBasis
from odeform.motion.reduced_motion import ReducedMotion
from odeform.schema import BEYOND, Parameter, soft_clip
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Geometry, PointCloud, Times

__all__ = ["HasSensitivities", "differentiable_points"]

EXACT = SolverSettings("dopri5", tolerance=1e-9, dtype="float64")
FIXED, CONTROLLED, SINGLE = 1e-5, 5e-4, 1e-2
"""Steps of central differences in normalised parameters: of solutions by fixed steps, which change smoothly, by
controlled ones, and of predictions in single precision."""
AGREE = 1e-6  # m, rad: where sensitivities start from the same motion, which nothing clips or holds
Solve = Callable[[Floats], Motion]
Array = np.ndarray


@runtime_checkable
class HasSensitivities(Protocol):
    """A model whose equations are differentiated, and solved with their derivatives."""

    def sensitivities(self, theta: Floats, times: Times, quality: SolverSettings) -> Floats:
        """Computes (1 + P, T, 6 + K): y at (T,) seconds under theta (P,), and its derivatives by theta."""
        ...


class _Linear(torch.autograd.Function):
    """Values that are known, of inputs (P,), with a Jacobian that is looked up when a gradient is asked for."""

    @staticmethod
    def forward(ctx: Any, inputs: torch.Tensor, values: Array, jacobian: Callable[[], Array]) -> torch.Tensor:
        ctx.jacobian = cache(jacobian)  # rows of a Jacobian are asked for one after the other
        return torch.tensor(values)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *grads: torch.Tensor) -> tuple[torch.Tensor, None, None]:  # pyright: ignore[reportIncompatibleMethodOverride]
        jacobian = torch.from_numpy(np.ascontiguousarray(ctx.jacobian()))  # (P, ...)
        return (jacobian * grads[0]).sum(dim=tuple(range(1, jacobian.ndim))), None, None


class _PerPoint(torch.autograd.Function):
    """Values (A, N, 3) of points (N, 3), each of which depends on its own point alone."""

    @staticmethod
    def forward(ctx: Any, points: torch.Tensor, values: Array, slopes: Callable[[], Array]) -> torch.Tensor:
        ctx.slopes = cache(slopes)
        return torch.tensor(values)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *grads: torch.Tensor) -> tuple[torch.Tensor, None, None]:  # pyright: ignore[reportIncompatibleMethodOverride]
        slopes = torch.from_numpy(ctx.slopes().astype(float))  # (A, N, 3, direction)
        return torch.einsum("ani,anid->nd", grads[0], slopes), None, None


def differentiable_points(
    predictor: Predictor, parameters: Mapping[str, Any], times: Any, geometry: Geometry | torch.Tensor | None
) -> torch.Tensor:
    """See `Predictor.torch`."""
    model, given, known = _prepared(predictor, parameters)
    if getattr(times, "requires_grad", False):
        raise InputError("times: expected numbers; motions are differentiated by parameters and points, not by time")
    clock = checked_times(np.asarray(times, dtype=float))
    rest, shape = _rest(model, geometry, known)
    learned = [known[p.name] for p in model.schema.learned]
    u = torch.stack([_normalised(p, given.get(p.name, v)) for p, v in zip(model.schema.learned, learned, strict=True)])

    def solve(at: Floats, moved: Geometry = shape) -> Motion:
        values = {p.name: p.denormalise(float(x)) for p, x in zip(model.schema.learned, at, strict=True)}
        return model.solve(moved, {**known, **values}, model.accurate, until=float(clock.max(initial=0.0)))

    here = u.detach().numpy()
    motion = solve(here)
    if isinstance(motion, ReducedMotion):
        azimuth = next((given.get(p.name, known[p.name]) for p in model.schema.parameters if p.role == "azimuth"), 0.0)
        moved = _reduced_points(motion, rest, azimuth, _coordinates(model, motion, solve, u, clock))
    else:
        moved = _moved_points(motion, solve, u, rest, clock)
    asked = (*parameters.values(), geometry, getattr(geometry, "points", None))
    tensors = [tensor for tensor in asked if isinstance(tensor, torch.Tensor)]
    like = tensors[0] if tensors else torch.empty(0)
    out = moved.to(like.device, max((t.dtype for t in tensors), key=lambda d: d.itemsize, default=like.dtype))
    return out[0] if np.ndim(times) == 0 else out


def _prepared(
    predictor: Predictor, parameters: Mapping[str, Any]
) -> tuple[Predictor, dict[str, torch.Tensor], dict[str, Any]]:
    """The model of the body that the parameters select, those that are tensors, in double precision, and all values."""
    given = predictor.schema.expanded(parameters)
    tensors = {name: value for name, value in given.items() if isinstance(value, torch.Tensor)}
    for name, value in tensors.items():
        if value.numel() != 1:
            raise InputError(f"{name}: expected a tensor of one number, got shape {tuple(value.shape)}")
    known = predictor.complete({**given, **{name: float(value.detach()) for name, value in tensors.items()}})
    model = predictor.model_of(known)
    for p in model.schema.parameters:
        if p.role == "body" and p.name in tensors:
            raise InputError(f"{p.name}: has no gradients; expected a number")
    if model.schema.needs_observations or not model.extrapolates:
        raise InputError(f"{predictor.model}: has no gradients; expected a model of parameters alone")
    return model, {name: value.reshape(()).cpu().double() for name, value in tensors.items()}, known


def _rest(
    model: Predictor, geometry: Geometry | torch.Tensor | None, known: Mapping[str, Any]
) -> tuple[torch.Tensor, Geometry]:
    """Points at rest (N, 3) as a tensor in double precision, and the geometry that they are of."""
    points = geometry if isinstance(geometry, torch.Tensor) else getattr(geometry, "points", model.rest.points)
    if len(points.shape) != 2 or points.shape[1] != 3:
        raise InputError(f"geometry: expected points (N, 3), got {tuple(points.shape)}")
    if not isinstance(points, torch.Tensor):
        return torch.from_numpy(np.asarray(points, dtype=float)), cast(Geometry, geometry or model.rest)
    rest = points.cpu().double()
    return rest, PointCloud(rest.detach().numpy())


def _normalised(parameter: Parameter, value: Any) -> torch.Tensor:
    """`Parameter.normalise` of a tensor or a number."""
    low, high, tensor = parameter.low, parameter.high, torch.as_tensor(value, dtype=torch.float64)
    if parameter.scale == "log":
        low, high, tensor = np.log(low), np.log(high), tensor.log()
    return 2.0 * (tensor - low) / (high - low) - 1.0


def _differences(function: Callable[[Floats], Array], at: Floats, step: float) -> Array:
    """(P, ...) the Jacobian of an array by each entry of `at` (P,), by central differences."""
    rows = []
    for direction in step * np.eye(len(at)):
        rows.append((function(at + direction) - function(at - direction)) / (2.0 * step))
    return np.stack(rows)


def _coordinates(model: Predictor, motion: ReducedMotion, solve: Solve, u: torch.Tensor, clock: Times) -> torch.Tensor:
    """(T, 6 + K) reduced coordinates, differentiable by u (P,)."""
    here, values = u.detach().numpy(), motion.coordinates(clock)

    def jacobian() -> Array:
        if isinstance(model, HasSensitivities):
            jet = model.sensitivities(soft_clip(here, 1.0, BEYOND), np.maximum(clock, 0.0), EXACT)
            if np.abs(jet[0] - values).max() < AGREE:
                beyond = np.maximum(np.abs(here) - 1.0, 0.0)
                return jet[1:] * (1.0 - np.tanh(beyond / BEYOND) ** 2)[:, None, None]  # the slope of `soft_clip`
        step = CONTROLLED if model.qualities and model.accurate.tolerance else FIXED
        return _differences(lambda at: cast(ReducedMotion, solve(at)).coordinates(clock), here, step)

    return cast(torch.Tensor, _Linear.apply(u, values, jacobian))


def _reduced_points(motion: ReducedMotion, rest: torch.Tensor, azimuth: Any, y: torch.Tensor) -> torch.Tensor:
    """(T, N, 3) metres: the formula above."""
    angle = torch.as_tensor(azimuth, dtype=torch.float64)
    zero, one = torch.zeros_like(angle), torch.ones_like(angle)
    turn = torch.stack([angle.cos(), -angle.sin(), zero, angle.sin(), angle.cos(), zero, zero, zero, one]).reshape(3, 3)
    anchor = torch.from_numpy(motion.space.anchor)
    x = (rest - anchor) @ turn
    body = x + torch.einsum("tk,kni->tni", y[:, 6:], _modes(motion.space.basis, x))
    wx, wy, wz = y[:, 3:6].T
    skew = torch.stack([0 * wx, -wz, wy, wz, 0 * wx, -wx, -wy, wx, 0 * wx], dim=1).reshape(-1, 3, 3)
    moved = body @ torch.linalg.matrix_exp(skew).mT + y[:, None, :3]
    return anchor + moved @ turn.T


def _modes(basis: DisplacementBasis, x: torch.Tensor) -> torch.Tensor:
    """(K, N, 3) the modes at canonical points x (N, 3), differentiable by them."""
    at = x.detach().numpy()
    values = np.empty((basis.modes, len(at), 3))
    basis.values(at, out=values)

    def slopes() -> Array:
        axes = np.broadcast_to(np.eye(3), (len(at), 3, 3))
        return basis.slopes(at, axes).transpose(0, 3, 2, 1)

    return cast(torch.Tensor, _PerPoint.apply(x, values, slopes))


def _moved_points(
    motion: Motion, solve: Callable[..., Motion], u: torch.Tensor, rest: torch.Tensor, clock: Times
) -> torch.Tensor:
    """(T, N, 3) metres, of a model that moves each point by itself."""
    here, at = u.detach().numpy(), rest.detach().numpy()
    shape, values = motion.geometry, motion.vertices(clock).astype(float)
    size = SINGLE * float(np.ptp(at, axis=0).max())

    def of(points: Array) -> Array:
        return solve(here, PointCloud(points)).vertices(clock).astype(float)

    def slopes() -> Array:
        pairs = [(of(at + way) - of(at - way)) / (2.0 * size) for way in size * np.eye(3)]
        return np.stack(pairs, axis=-1)

    def jacobian() -> Array:
        return _differences(lambda moved: solve(moved, shape).vertices(clock).astype(float), here, SINGLE)

    by_points = _PerPoint.apply(rest, values, slopes)
    by_parameters = _Linear.apply(u, np.zeros_like(values), jacobian)
    return cast(torch.Tensor, by_points) + cast(torch.Tensor, by_parameters)
