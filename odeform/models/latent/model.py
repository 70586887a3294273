"""ODeform, ready to predict."""

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from odeform.checkpoint import Checkpoint
from odeform.compiling import compiles
from odeform.models.latent.compiled import make_compiled_field
from odeform.models.latent.config import ModelConfig
from odeform.models.latent.inference import make_decoder, make_encoder, make_field, pool_shape
from odeform.models.latent.sensitivity import Sensitivities, make_sensitivities
from odeform.models.latent.weights import check_weights
from odeform.models.model import Model
from odeform.models.residual import ParameterRegression, parameter_residual
from odeform.models.solved import Problem
from odeform.models.solved_batch import BatchProblem
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.recent import Recent
from odeform.solver.batch_steps import Together
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Geometry, Times

if TYPE_CHECKING:
    from odeform.models.training.run import Run

__all__ = ["PREFIX", "LatentModel"]

DECODED = 32  # states at once: the features of many more leave the cache
PREFIX = "net."
"""Prefix of the network's arrays in a checkpoint."""


class LatentModel(Model):
    """Latent neural ODEs for pose and deformation (the paper's model, one latent state per object)."""

    model = "latent"
    made_of = (
        "neural networks: two latent neural ODEs between encoders and decoders, as in the paper; "
        "where it helps, a kernel regression adds what they leave unexplained"
    )
    resumable = True
    descends = True
    together = 128
    ablations: ClassVar[Mapping[str, str]] = {
        "ode": "states stay as they start",
        "clock": "decoders are not conditioned on time",
        "parameters": "decoders are not conditioned on parameters",
        "random-features": "decoders have trained features only",
        "residual": "what is left unexplained is not regressed",
    }

    @classmethod
    def train(cls, run: "Run") -> Checkpoint:
        from odeform.models.latent.training.fit import train_latent

        return train_latent(run)

    def _read(self, checkpoint: Checkpoint) -> None:
        super()._read(checkpoint)
        network = checkpoint.config["network"]
        self.config = ModelConfig(**{**network, "decoder_widths": tuple(network["decoder_widths"])})
        self.weights = {k.removeprefix(PREFIX): v for k, v in checkpoint.arrays.items() if k.startswith(PREFIX)}
        check_weights(self.weights, self.config)
        self._encode = make_encoder(self.weights, self.config)
        self._decoder = make_decoder(self.weights, self.config)
        make = make_compiled_field if compiles() else make_field
        self._fields = {dtype: make(self.weights, self.config, dtype) for dtype in (np.float32, np.float64)}
        self.residual = parameter_residual(checkpoint.arrays, self.space.coordinates, self.config.parameters)
        self._pooled: Recent[tuple[EvaluatedBasis, list[Floats]]] = Recent(1)

    def _pool(self, evaluated: EvaluatedBasis) -> list[Floats]:
        def pooled() -> tuple[EvaluatedBasis, list[Floats]]:
            points = evaluated.rest.astype(float) / self.space.gyration_radius
            return evaluated, pool_shape(self.weights, self.config, points, evaluated.areas)

        return self._pooled.get(id(evaluated), pooled)[1]

    def problem(self, theta: Floats, evaluated: EvaluatedBasis, dtype: type = np.float64) -> Problem:
        decode, start = self._decoder(theta), self._encode(self._pool(evaluated), theta, dtype)
        origin = decode(np.zeros(1), start[None])
        return Problem(self._fields[dtype](theta), start, lambda times, states: decode(times, states) - origin)

    def batch_problem(
        self, theta: Floats, geometry: Geometry, azimuths: Times, dtype: type
    ) -> Callable[[], BatchProblem]:
        pooled = {each: self._pool(self.evaluate_basis(geometry, each)) for each in dict.fromkeys(azimuths.tolist())}
        features = [np.stack(branch) for branch in zip(*(pooled[each] for each in azimuths.tolist()), strict=True)]
        start = self._encode(features, theta, dtype)

        def decoded(times: Times, states: Floats) -> Floats:
            every, clock = np.repeat(theta, len(times), axis=0), np.tile(times, len(theta))
            rows = states.reshape(len(every), -1)
            parts = (slice(begin, begin + DECODED) for begin in range(0, len(every), DECODED))
            y = np.concatenate([self._decoder(every[part])(clock[part], rows[part]) for part in parts])
            return y.reshape(len(theta), len(times), -1)

        origin = decoded(np.zeros(1), start[:, None])
        field = Together([self._fields[dtype](each) for each in theta])
        return lambda: BatchProblem(field, start, lambda times, states: decoded(times, states) - origin)

    def sensitivities(self, theta: Floats, times: Times, quality: SolverSettings) -> Float[np.ndarray, "jet times y"]:
        """(1 + P, T, 6 + K): the motion y of the trained body under theta (P,) in [-1, 1] at (T,) seconds, and its
        derivatives by each parameter. It does not include what continues the motion beyond the window."""
        body = self.evaluate_basis(self.rest, 0.0)
        clock = self.schema.window.soft_clamped(times)
        jet = self._sensitivities(self._pool(body), theta, quality, clock)
        if self.residual is None:
            return jet
        assert isinstance(self.residual.regression, ParameterRegression)
        spline = CubicSpline(self.residual.times, self.residual.regression.jet(theta), axis=1)
        return self.residual.weight * jet + spline(np.clip(clock, 0.0, self.residual.stop))

    @cached_property
    def _sensitivities(self) -> Sensitivities:
        return make_sensitivities(self.weights, self.config)
