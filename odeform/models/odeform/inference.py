"""Fast inference of the ODeform network for one object: numpy, a small state, no autograd.

At batch size one a field evaluation is a handful of small matrix-vector products, where a framework's dispatch costs
more than the arithmetic. `network.py` is the same network for training; a test holds both together.
"""

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag

from odeform.models.odeform.config import ModelConfig
from odeform.motion.base import SolveStats
from odeform.motion.reduced_space import POSE, small_motion
from odeform.solver.integrate import SolverSettings, integrate
from odeform.solver.method import Field
from odeform.solver.registry import get_method
from odeform.solver.runge_kutta import gemv
from odeform.solver.solution import Solution, Status
from odeform.types import Arrays, Floats

__all__ = [
    "Decoder",
    "Field",
    "FieldLayers",
    "LatentTrajectory",
    "check_weights",
    "field_layers",
    "layers_of",
    "make_decoder",
    "make_encoder",
    "make_field",
    "pool_shape",
]


def _silu(x: Floats) -> Floats:
    # the logistic function by tanh: twice as fast as by exp, and nothing overflows
    return x * (0.5 + 0.5 * np.tanh(0.5 * x))


def _same(x: Floats) -> Floats:
    return x


def layers_of(weights: Arrays, prefix: str, dtype: type) -> list[tuple[Floats, Floats]]:
    """Weight and bias of each linear layer of an `mlp`, column-major: the faster order for matrix-vector products."""
    out = []
    index = 0
    while f"{prefix}.{index}.weight" in weights:
        matrix = np.asfortranarray(weights[f"{prefix}.{index}.weight"].astype(dtype))
        out.append((matrix, weights[f"{prefix}.{index}.bias"].astype(dtype)))
        index += 2
    return out


def _mlp(layers: list[tuple[Floats, Floats]], x: Floats, activation: Callable[[Floats], Floats]) -> Floats:
    """x (..., inputs) -> (..., outputs)."""
    for matrix, bias in layers[:-1]:
        x = activation(x @ matrix.T + bias)
    matrix, bias = layers[-1]
    return x @ matrix.T + bias


def check_weights(weights: Arrays, config: ModelConfig) -> None:
    """KeyError or ValueError unless every array of the network is there, in its shape."""
    wanted: dict[str, tuple[int, ...]] = {"gains": (POSE + config.modes,), "time_scale": ()}
    for branch in config.branches:
        for part, sizes in config.sizes(branch).items():
            name = f"{branch}_{part}"
            if part == "decoder.readout":
                wanted[f"{name}.weight"] = (sizes[1], sizes[0])
                continue
            if part == "decoder.random" and not config.random_features:
                continue
            for layer, (before, after) in enumerate(itertools.pairwise(sizes)):
                wanted[f"{name}.{2 * layer}.weight"] = (after, before)
                wanted[f"{name}.{2 * layer}.bias"] = (after,)
        for statistic in ("pooled_mean", "pooled_gain"):
            wanted[f"{branch}_encoder.{statistic}"] = (config.point_width,)
    for name, shape in wanted.items():
        if weights[name].shape != shape:
            raise ValueError(f"{name}: expected shape {shape}, got {weights[name].shape}")
        if not np.isfinite(weights[name]).all():
            raise ValueError(f"{name}: not finite")


def pool_shape(weights: Arrays, config: ModelConfig, points: Floats, shares: Floats) -> list[Floats]:
    """Features of a shape for each branch: points (N, 3) in units of the body's size, shares (N,) of its area.

    They are left at zero where no feature counts, as of a model that saw one shape: a million points take seconds.
    """

    def pooled(branch: str) -> Floats:
        gain = weights[f"{branch}_encoder.pooled_gain"]
        if not gain.any():
            return np.zeros(len(gain))
        return shares @ _mlp(layers_of(weights, f"{branch}_encoder.points", np.float64), points, _silu)

    return [pooled(branch) for branch in config.branches]


def make_encoder(weights: Arrays, config: ModelConfig) -> Callable[[list[Floats], Floats, type], Floats]:
    """(pooled shape features, theta (P,) in [-1, 1], precision) -> the state at time 0."""
    statistics = [
        tuple(weights[f"{branch}_encoder.pooled_{name}"].astype(float) for name in ("mean", "gain"))
        for branch in config.branches
    ]
    heads = [layers_of(weights, f"{branch}_encoder.head", np.float64) for branch in config.branches]

    def encode(pooled: list[Floats], theta: Floats, dtype: type) -> Floats:
        parts = [
            _mlp(head, np.concatenate([(features - mean) * gain, theta]), _silu)
            for head, features, (mean, gain) in zip(heads, pooled, statistics, strict=True)
        ]
        return np.concatenate(parts).astype(dtype)

    return encode


def _folded(layers: list[tuple[Floats, Floats]], theta: Floats) -> list[tuple[Floats, Floats]]:
    """The same layers without their last inputs, parameters that stay as they are."""
    (first, bias), *others = layers
    seen = first.shape[1] - len(theta)
    return [(first[:, :seen], bias + first[:, seen:] @ theta), *others]


@dataclass(frozen=True, eq=False)
class FieldLayers:
    """The branches' fields as one network: dz/dt = last tanh(middle tanh(first z + told theta)), each with its bias.

    There are zeros where the branches do not see each other: three products rather than six, and at this size a call
    costs more than the zeros.
    """

    first: Floats
    told: Floats
    middle: Floats
    last: Floats
    biases: tuple[Floats, Floats, Floats]


def field_layers(weights: Arrays, config: ModelConfig) -> FieldLayers:
    """In double precision, with time in seconds."""
    rate = 1.0 / float(weights["time_scale"])
    branches = [layers_of(weights, f"{branch}_field", np.float64) for branch in config.branches]
    # each branch sees the state up to the end of its own part
    sights = [branch[0][0].shape[1] - config.parameters for branch in branches]
    first = np.concatenate(
        [np.pad(m[:, :s], ((0, 0), (0, config.state - s))) for ((m, _), *_), s in zip(branches, sights, strict=True)]
    )
    told = np.concatenate([m[:, s:] for ((m, _), *_), s in zip(branches, sights, strict=True)])
    middle, last = (np.asarray(block_diag(*(branch[layer][0] for branch in branches))) for layer in (1, 2))
    one, two, three = (np.concatenate([branch[layer][1] for branch in branches]) for layer in range(3))
    return FieldLayers(first, told, middle, rate * last, (one, two, rate * three))


def make_field(weights: Arrays, config: ModelConfig, dtype: type) -> Callable[[Floats], Field]:
    """theta (P,) -> the field dz/dt = f(z). Matrices are laid out once; a change of parameters only changes a bias."""
    layers = field_layers(weights, config)
    matrices = [np.asfortranarray(m.astype(dtype)) for m in (layers.first, layers.middle, layers.last)]
    bias, *others = layers.biases
    later = [other.astype(dtype) for other in others]

    def fold(theta: Floats) -> Field:
        return _field(matrices, [(bias + layers.told @ theta).astype(dtype), *later])

    return fold


def _field(matrices: list[Floats], biases: list[Floats]) -> Field:
    """Three layers with tanh between them, spelt out: a call takes a few microseconds, and a loop a tenth of them."""
    product, tanh = gemv(matrices[0].dtype), np.tanh
    (first, middle, last), (first_bias, middle_bias, last_bias) = matrices, biases

    def field(_: float, state: Floats) -> Floats:
        x = product(1.0, first, state, 1.0, first_bias)
        x = product(1.0, middle, tanh(x, x), 1.0, middle_bias)
        return product(1.0, last, tanh(x, x), 1.0, last_bias)

    return field


Decoder = Callable[[Floats, Floats], Floats]


def make_decoder(weights: Arrays, config: ModelConfig) -> Callable[[Floats], Decoder]:
    """theta (P,) -> the decoder: (T,) seconds, (T, state) -> (T, 6 + K) in m and rad, not yet relative to the start.

    In double precision: a readout solved for by least squares has large weights that cancel.
    """
    gains = weights["gains"].astype(float)
    parts = []
    for branch in config.branches:
        place = slice(0, config.rigid_latent) if branch == "rigid" else slice(config.state - config.local_latent, None)
        nets = [layers_of(weights, f"{branch}_decoder.{part}", np.float64) for part in ("hidden", "random")]
        readout = np.asfortranarray(weights[f"{branch}_decoder.readout.weight"].astype(float))
        parts.append((place, nets, readout))

    def fold(theta: Floats) -> Decoder:
        folded = [(place, [_folded(net, theta) for net in nets if net], readout) for place, nets, readout in parts]

        def decode(times: Floats, states: Floats) -> Floats:
            clock, out = (2.0 * times / (times + config.clock) - 1.0)[:, None], []
            for place, nets, readout in folded:
                features = states[:, place]
                for index, net in enumerate(nets):
                    # random features are linear in between
                    told = np.concatenate([features, clock], axis=1)
                    seen = _silu(_mlp(net, told, _silu if index == 0 else _same))
                    features = np.concatenate([features, seen], axis=1)
                out.append(features @ readout.T)
            if not config.rigid:
                out.insert(0, np.zeros((len(states), POSE)))
            return np.concatenate(out, axis=1) * gains

        return decode

    return fold


def _in_words(quality: SolverSettings) -> str:
    setting = f"h = {1e3 * quality.step:.3g} ms" if quality.step else f"tol {quality.tolerance:.0e}"
    return f"{quality.method}, {setting}"


ROUNDING_MM = 1e-3  # of states in single precision: `odeform stress` finds about half as much
RECENT = 4  # answers that are kept: pose, deformation and gradient of a moment are asked for one after the other


class LatentTrajectory:
    """A solved state z(t), decoded where asked. Grows when asked for later times; never changes.

    Where controlled steps fail, steps of `fallback`, a fixed quality, take over from the last good state.
    """

    def __init__(
        self,
        field: Field,
        decode: Decoder,
        start: Floats,
        quality: SolverSettings,
        fallback: SolverSettings,
        until: float,
        gyration_radius: float,
    ) -> None:
        self._field, self._decode, self._quality, self._fallback, self._gyration_radius = (
            field,
            decode,
            quality,
            fallback,
            gyration_radius,
        )
        begin = time.perf_counter()
        with np.errstate(all="ignore"):  # an overflow ends the integration with a status
            self._solution, self._rest = integrate(field, start, quality, until), None
            self._extend(until)
        self._wall_ms = 1e3 * (time.perf_counter() - begin)
        self._origin = decode(np.zeros(1), start[None])
        self._span = until
        self._recent: tuple[tuple[bytes, Floats], ...] = ()

    def _extend(self, until: float) -> None:
        """Solve at least to `until` seconds, as far as it goes."""
        first = integrate(self._field, self._solution.states[0], self._quality, until, begin=self._solution)
        if first.status is not Status.OK and self._quality.tolerance is not None:
            begin = first.end if self._rest is None else self._rest
            self._rest = integrate(self._field, first.states[-1], self._fallback, until, begin=begin)

    def _sample(self, times: Floats) -> Floats:
        """(T, state) at `times` that were solved for."""
        first, rest = self._solution, self._rest
        if rest is None:
            return first.sample(times)
        return np.where((times <= first.end)[:, None], first.sample(times), rest.sample(times))

    @property
    def _last(self) -> Solution:
        return self._solution if self._rest is None else self._rest

    @property
    def last_good(self) -> float:
        return float("inf") if self._last.status is Status.OK else self._last.end

    def reduced(self, times: Floats) -> Floats:
        asked = np.asarray(times, dtype=float)
        key = asked.tobytes()
        known = next((y for other, y in self._recent if other == key), None)
        if known is None:
            with np.errstate(all="ignore"):
                self._extend(float(asked.max()))
            # y(0) = 0 to the last bit: the product over many rows rounds otherwise than that over one
            known = (self._decode(asked, self._sample(asked)) - self._origin) * (asked > 0.0)[:, None]
            known.flags.writeable = False
            self._recent = ((key, known), *self._recent)[:RECENT]
        return known

    @cached_property
    def _error_mm(self) -> float | None:
        """Step doubling (Hairer, Norsett & Wanner, Solving ODEs I, II.4): largest error over the span, in RMS mm.

        The same integration with twice the step, or ten times the tolerance, differs from this one by a multiple of
        its error: 2^p - 1 or 9 in the limit of small steps, less where the field bends within a step, at the kick and
        at landings. Divided by 2 (Euler: 1) or 6, it rather overstates than understates the error of such motions.
        Rounding in single precision, which both have alike, comes on top.
        """
        quality = self._quality
        if quality.step is not None:
            coarse = SolverSettings(quality.method, step=2.0 * quality.step)
            share = min(2.0, 2.0 ** get_method(quality.method).order - 1.0)
        else:
            coarse, share = SolverSettings(quality.method, tolerance=10.0 * (quality.tolerance or 0.0)), 6.0
        with np.errstate(all="ignore"):
            other = integrate(self._field, self._solution.states[0], coarse, self._span)
        if other.status is not Status.OK or self._solution.status is not Status.OK:
            return None
        times = np.linspace(0.0, self._span, 129)[1:]
        difference = self._decode(times, self._solution.sample(times)) - self._decode(times, other.sample(times))
        rounding = ROUNDING_MM if quality.dtype == "float32" else 0.0
        return float(1e3 * small_motion(difference, self._gyration_radius).max() / share) + rounding

    @property
    def stats(self) -> SolveStats:
        first, rest = self._solution, self._rest
        solver, status = _in_words(self._quality), self._last.status.value
        steps, evaluations = first.steps, first.evaluations
        if rest is not None:
            failed = f"{solver} failed at t = {first.end:.3f} s: {first.status.value}"
            solver = f"{_in_words(self._fallback)} ({failed})"
            status = "fixed steps" if rest.status is Status.OK else f"fixed steps, {status}"
            steps, evaluations = steps + rest.steps, evaluations + rest.evaluations
        return SolveStats(
            solver=solver,
            steps=steps,
            evaluations=evaluations,
            rejected=first.rejected,
            status=status,
            wall_ms=self._wall_ms,
            estimate=lambda: self._error_mm,
        )
