"""Regresses what an ODE leaves unexplained of the training motions on what causes the motion.

y(t; theta) = weight * ODE(t; theta) + regression(t; theta): the autoregressive scheme of Kennedy and O'Hagan (2000),
with the ODE in place of the cheap simulation. The regression is that of the training motions less the weighted ODE.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from odeform.models.kernels.regression import Kernel, KernelRegression
from odeform.models.kernels.ridge import ORDERS
from odeform.motion.reduced_space import POSE
from odeform.motion.trajectory import Adjustment, Moving
from odeform.types import Arrays, Floats, Times

__all__ = ["PARTS", "FrameRegression", "ParameterRegression", "Residual", "parameter_residual", "weight_of"]

PREFIX = "correction."
FADES = 0.1  # s
PARTS = {"shift": slice(0, 3), "rotation": slice(3, POSE), "deformation": slice(POSE, None)}
"""Columns of y that are regressed together."""


@runtime_checkable
class FrameRegression(Protocol):
    """A regression of whole motions."""

    def frames(self, inputs: Any) -> Float[np.ndarray, "*batch times y"]:
        """Computes (B, T, 6 + K) at the residual's frames, from what causes B motions; of one motion B may be left
        out."""
        ...


@dataclass(frozen=True, eq=False)
class Residual:
    """Adds a regression to a weighted motion of an ODE in the frames `times`; after the last, what it adds stays."""

    times: Times
    """(T,) s."""
    weight: Float[np.ndarray, " y"]
    """(6 + K,) weights of the ODE's motion, by coordinate."""
    regression: FrameRegression
    rigid: float = 1.0
    """Factor on all that it does to the rigid motion."""

    @property
    def stop(self) -> float:
        """The time of its last frame, s."""
        return float(self.times[-1])

    def over_time(self, inputs: Any) -> Callable[[Times], Float[np.ndarray, "*batch times y"]]:
        """Maps (T,) s to (B, T, 6 + K): the regression, as a cubic spline through its frames, constant outside of them;
        to (T, 6 + K) where the regression leaves out B."""
        frames = self.regression.frames(inputs) * self._factors
        return lambda times: self._spline(np.clip(times, self.times[0], self.times[-1])) @ frames

    @property
    def _factors(self) -> Float[np.ndarray, " y"]:
        """(6 + K,)"""
        return np.where(np.arange(len(self.weight)) < POSE, self.rigid, 1.0)

    @property
    def _taken(self) -> Float[np.ndarray, " y"]:
        """(6 + K,) how much of the ODE's motion is taken away."""
        return self._factors * (1.0 - self.weight)

    @cached_property
    def _spline(self) -> CubicSpline:
        """(T',) s -> (T', T) what each frame counts there."""
        return CubicSpline(self.times, np.eye(len(self.times)))

    def adjustment(self, own: Moving, inputs: Any) -> Adjustment:
        """Adds it to the coordinates (T, 6 + K) of the motion `own` of the ODE, or of several; zero at time 0."""
        added_at, taken, stop = self.over_time(inputs), self._taken, self.stop

        def adjust(times: Times, y: Floats) -> Floats:
            added = added_at(times).reshape(y.shape)  # one motion alone, or B of them
            if taken.any():
                added -= taken * (y if (times <= stop).all() else own.reduced(np.minimum(times, stop)))
            return y + added * (times > 0.0)[:, None]

        return adjust

    def deformation_adjustment(self, inputs: Any) -> Adjustment:
        """Adds it to the deformation alone of coordinates (T, 6 + K).

        After the last frame it fades away, linearly over `FADES` seconds: where a body comes to rest, it is as its ODE
        says.
        """
        added_at, taken, stop = self.over_time(inputs), self._taken, self.stop

        def adjust(times: Times, y: Floats) -> Floats:
            fading = np.clip(1.0 - (times - stop) / FADES, 0.0, 1.0)[:, None]
            out = y.copy()
            out[..., POSE:] += fading * (added_at(times).reshape(y.shape) - taken * y)[..., POSE:]
            return out

        return adjust


def weight_of(parts: Mapping[str, float], scale: Float[np.ndarray, " coefficients"]) -> Float[np.ndarray, " y"]:
    """Computes (6 + K,) weights of coordinates, from those of shift, rotation and deformation, and the scale (K,) of
    the deformation's coefficients."""
    out = np.concatenate([np.ones(POSE), scale])
    for part, columns in PARTS.items():
        out[columns] *= parts[part]
    return out


@dataclass(frozen=True, eq=False)
class RegressedPart:
    """The regression of one part of y over all frames: a kernel regression of the amplitudes of its trajectories."""

    regression: KernelRegression
    """(P,) -> (M,)."""
    modes: Float[np.ndarray, "modes entries"]
    """Trajectories of residuals, flat."""
    mean: Float[np.ndarray, " entries"]
    """Mean of the training residuals."""
    weight: float
    """Weight of the ODE's motion."""


@dataclass(frozen=True, eq=False)
class ParameterRegression:
    """Frames (T, 6 + K) from normalised parameters: shift, rotation and deformation have a kernel each."""

    shape: tuple[int, int]
    """T and 6 + K."""
    parts: Mapping[str, RegressedPart]

    def frames(self, inputs: Float[np.ndarray, "*batch parameters"]) -> Float[np.ndarray, "*batch times y"]:
        """Computes (T, 6 + K) at theta (P,) in [-1, 1], or (B, T, 6 + K) at theta (B, P)."""
        out = np.zeros((*inputs.shape[:-1], *self.shape))
        for name, part in self.parts.items():
            found = part.regression(np.atleast_2d(inputs)) @ part.modes + part.mean
            out[..., PARTS[name]] = found.reshape(*out.shape[:-1], -1)
        return out

    def jet(self, theta: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, "jet times y"]:
        """Computes (1 + P, T, 6 + K) at theta (P,) in [-1, 1]: the frames, and their derivatives by each parameter."""
        out = np.zeros((1 + len(theta), *self.shape))
        for name, part in self.parts.items():
            found = part.regression.jet(theta) @ part.modes
            found[0] += part.mean
            out[..., PARTS[name]] = found.reshape(*out.shape[:2], -1)
        return out

    def first(self, modes: int) -> "ParameterRegression":
        """Restricts the regression to a model that keeps the first `modes` of its deformation."""
        (frames, coordinates), parts = self.shape, dict(self.parts)
        if part := parts.get("deformation"):
            flat = np.stack([part.mean, *part.modes]).reshape(-1, frames, coordinates - POSE)
            mean, *rest = flat[..., :modes].reshape(len(flat), -1)
            parts["deformation"] = replace(part, mean=mean, modes=np.array(rest))
        return ParameterRegression((frames, POSE + modes), parts)

    def residual(self, times: Times) -> Residual:
        """Returns the residual with these frames at `times` (T,) s."""
        weights = {name: self.parts[name].weight if name in self.parts else 1.0 for name in PARTS}
        return Residual(times, weight_of(weights, np.ones(self.shape[1] - POSE)), self)

    def arrays(self, times: Times) -> Arrays:
        """The arrays of a checkpoint, by name; `parameter_residual` reads them."""
        out = {f"{PREFIX}times": times}
        for name, part in self.parts.items():
            # weights of opposite sign cancel, so that they need all their digits
            scales = part.regression.kernel.scales
            values = {
                "scales": scales,
                "theta": part.regression.inputs / scales,
                "weights": part.regression.weights,
                "share": np.array([part.weight]),
                "order": np.array([part.regression.kernel.order]),
                "modes": part.modes.astype(np.float32),
                "mean": part.mean,
            }
            out |= {f"{PREFIX}{name}.{key}": value for key, value in values.items()}
        return out


def parameter_residual(arrays: Arrays, coordinates: int, parameters: int) -> Residual | None:
    """The residual that is regressed on the parameters; None for a checkpoint without one.

    ValueError unless arrays are finite and of the expected shapes.
    """
    if f"{PREFIX}times" not in arrays:
        return None
    times = arrays[f"{PREFIX}times"].astype(float)
    parts = {}
    for name, columns in PARTS.items():
        start = f"{PREFIX}{name}."
        of = {key.removeprefix(start): a.astype(float) for key, a in arrays.items() if key.startswith(start)}
        if of:
            entries = len(times) * len(range(*columns.indices(coordinates)))
            # files of before these were fitted have none of them
            of = {"mean": np.zeros(entries), "share": np.ones(1), "order": np.full(1, ORDERS[0]), **of}
            parts[name] = _checked_part(of, parameters, entries)
    return ParameterRegression((len(times), coordinates), parts).residual(times)


def _checked_part(arrays: Arrays, parameters: int, entries: int) -> RegressedPart:
    known, modes = len(arrays["theta"]), len(arrays["modes"])
    shapes = {"theta": (known, parameters), "scales": (parameters,), "weights": (known, modes), "share": (1,)}
    shapes |= {"order": (1,), "modes": (modes, entries), "mean": (entries,)}
    for key, shape in shapes.items():
        if arrays[key].shape != shape or not np.isfinite(arrays[key]).all():
            raise ValueError(f"{PREFIX}: expected finite arrays, one of shape {shape}, got {arrays[key].shape}")
    if not (arrays["scales"] > 0.0).all():
        raise ValueError(f"{PREFIX}: expected positive length scales")
    weight, order = float(arrays["share"][0]), float(arrays["order"][0])
    if not 0.0 <= weight <= 1.0:
        raise ValueError(f"{PREFIX}: expected an ODE weight from 0 to 1, got {weight}")
    if order not in ORDERS:
        raise ValueError(f"{PREFIX}: expected a kernel of order {' or '.join(map(str, ORDERS))}, got {order}")
    kernel = Kernel(arrays["scales"], int(order))
    regression = KernelRegression(kernel, arrays["theta"] * arrays["scales"], arrays["weights"])
    return RegressedPart(regression, arrays["modes"], arrays["mean"], weight)
