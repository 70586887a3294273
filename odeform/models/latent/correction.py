"""What the latent ODE leaves unexplained of the training motions, regressed on the parameters.

y(t; theta) = share * ODE(t; theta) + rest(t; theta): the autoregressive scheme of Kennedy and O'Hagan (2000), with the
latent ODE in place of the cheap simulation. The rest is a kernel ridge regression (Matern) of the training motions
less that share. Shift, rotation and deformation have a share and a kernel each.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from odeform.models.kernel_search import ORDERS
from odeform.models.matern import matern, matern_slope
from odeform.motion.reduced_space import POSE
from odeform.types import Arrays, Floats

__all__ = ["PARTS", "CorrectedPart", "Correction"]

PREFIX = "correction."
PARTS = {"shift": slice(0, 3), "rotation": slice(3, POSE), "deformation": slice(POSE, None)}
"""Columns of y that are regressed together."""


@dataclass(frozen=True, eq=False)
class CorrectedPart:
    """The regression of one part of y, over all corrected frames."""

    theta: Float[np.ndarray, "sequences parameters"]
    """Training parameters, divided by the length scales."""
    scales: Float[np.ndarray, " parameters"]
    weights: Float[np.ndarray, "sequences modes"]
    modes: Float[np.ndarray, "modes entries"]
    """Trajectories of residuals, flat."""
    mean: Float[np.ndarray, " entries"]
    """Of the training residuals."""
    share: float
    """Of the ODE's own motion that is kept."""
    order: int
    """Of the Matern kernel."""

    def at(self, theta: Floats) -> Float[np.ndarray, "jet entries"]:
        """(1 + P, T columns): the residual at theta (P,) in [-1, 1], and its derivatives by each parameter."""
        slopes = (matern_slope(theta / self.scales - self.theta, self.order) / self.scales).T
        return np.concatenate([self.value(theta)[None], slopes @ self.weights @ self.modes])

    def value(self, theta: Floats) -> Float[np.ndarray, " entries"]:
        """(T columns,): the residual alone."""
        return matern((theta / self.scales)[None], self.theta, self.order)[0] @ self.weights @ self.modes + self.mean


class Correction:
    """Adds to the motions of the ODE in the first frames, or in all; beyond them, the last value is kept."""

    def __init__(self, times: Floats, coordinates: int, parts: dict[str, CorrectedPart]) -> None:
        """`times` (T,) s of the frames, the number 6 + K of coordinates, and the corrected `parts` by name."""
        self._times, self._coordinates, self.parts = times, coordinates, parts
        self.shares: Float[np.ndarray, " y"] = np.ones(coordinates)
        """Of each coordinate of the ODE's motion."""
        for name, part in parts.items():
            self.shares[PARTS[name]] = part.share

    @property
    def stop(self) -> float:
        """s: the last of the corrected frames."""
        return float(self._times[-1])

    def first(self, modes: int) -> "Correction":
        """The correction of a model that keeps the first `modes` of its deformation."""
        parts, kept = dict(self.parts), POSE + modes
        if part := parts.get("deformation"):
            trajectories = np.stack([part.mean, *part.modes]).reshape(-1, len(self._times), self._coordinates - POSE)
            mean, *rest = trajectories[..., :modes].reshape(len(trajectories), -1)
            parts["deformation"] = replace(part, mean=mean, modes=np.array(rest))
        return Correction(self._times, kept, parts)

    def jet(self, theta: Floats) -> Callable[[Floats], Float[np.ndarray, "jet times y"]]:
        """(T,) s -> (1 + P, T, 6 + K) at theta (P,) in [-1, 1]: values, and derivatives by each parameter."""
        frames = np.zeros((1 + len(theta), len(self._times), self._coordinates))
        for name, part in self.parts.items():
            frames[..., PARTS[name]] = part.at(theta).reshape(*frames.shape[:2], -1)
        spline = CubicSpline(self._times, frames, axis=1)
        return lambda times: spline(np.clip(times, self._times[0], self._times[-1]))

    def over_time(self, theta: Floats) -> Callable[[Floats], Float[np.ndarray, "times y"]]:
        """(T,) s -> (T, 6 + K) at theta (P,) in [-1, 1]: a cubic spline through the corrected frames."""
        frames = np.zeros((len(self._times), self._coordinates))
        for name, part in self.parts.items():
            frames[:, PARTS[name]] = part.value(theta).reshape(len(frames), -1)
        spline = CubicSpline(self._times, frames)
        return lambda times: spline(np.clip(times, self._times[0], self._times[-1]))

    def at(
        self, theta: Float[np.ndarray, "batch parameters"], times: Float[np.ndarray, " times"]
    ) -> Float[np.ndarray, "batch times y"]:
        """(B, T, 6 + K) at theta (B, P) in [-1, 1] and (T,) s: as `over_time`, for many motions."""
        times = np.clip(times, self._times[0], self._times[-1])
        out = np.zeros((len(theta), len(times), self._coordinates))
        for name, part in self.parts.items():
            known = np.concatenate([part.mean[None], part.modes]).reshape(1 + len(part.modes), len(self._times), -1)
            mean, modes = np.split(CubicSpline(self._times, known, axis=1)(times), [1])
            weights = matern(theta / part.scales, part.theta, part.order) @ part.weights
            out[..., PARTS[name]] = mean + np.tensordot(weights, modes, axes=1)
        return out

    def arrays(self) -> Arrays:
        """The arrays of a checkpoint, by name; `from_arrays` reads them."""
        out = {f"{PREFIX}times": self._times}
        for name, part in self.parts.items():
            # weights of opposite sign cancel, so that they need all their digits
            values = {
                "scales": part.scales,
                "theta": part.theta,
                "weights": part.weights,
                "share": np.array([part.share]),
                "order": np.array([part.order]),
            }
            values |= {"modes": part.modes.astype(np.float32), "mean": part.mean}
            out |= {f"{PREFIX}{name}.{key}": value for key, value in values.items()}
        return out

    @classmethod
    def from_arrays(cls, arrays: Arrays, coordinates: int, parameters: int) -> "Correction | None":
        """None for a checkpoint without one. ValueError unless arrays are finite and of the expected shapes."""
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
        return cls(times, coordinates, parts)


def _checked_part(arrays: Arrays, parameters: int, entries: int) -> CorrectedPart:
    known, modes = len(arrays["theta"]), len(arrays["modes"])
    shapes = {"theta": (known, parameters), "scales": (parameters,), "weights": (known, modes), "share": (1,)}
    shapes |= {"order": (1,)}
    for key, shape in {**shapes, "modes": (modes, entries), "mean": (entries,)}.items():
        if arrays[key].shape != shape or not np.isfinite(arrays[key]).all():
            raise ValueError(f"{PREFIX}: expected finite arrays, one of shape {shape}, got {arrays[key].shape}")
    if not (arrays["scales"] > 0.0).all():
        raise ValueError(f"{PREFIX}: expected positive length scales")
    share = float(arrays.pop("share")[0])
    if not 0.0 <= share <= 1.0:
        raise ValueError(f"{PREFIX}: expected a share from 0 to 1, got {share}")
    order = float(arrays.pop("order")[0])
    if order not in ORDERS:
        raise ValueError(f"{PREFIX}: expected a kernel of order {' or '.join(map(str, ORDERS))}, got {order}")
    return CorrectedPart(**arrays, share=share, order=int(order))
