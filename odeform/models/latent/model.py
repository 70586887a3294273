"""ODeform, ready to predict."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from jaxtyping import Float

from odeform.checkpoint import Checkpoint
from odeform.models.integrated_model import IntegratedModel
from odeform.models.latent.config import ModelConfig
from odeform.models.latent.correction import Correction
from odeform.models.latent.inference import (
    Decoder,
    Field,
    make_batch_field,
    make_decoder,
    make_encoder,
    make_field,
    pool_shape,
)
from odeform.models.latent.latent_trajectory import LatentTrajectory
from odeform.models.latent.sensitivity import Sensitivities, make_sensitivities
from odeform.models.latent.weights import check_weights
from odeform.models.solved_batch import BatchProblem, SolvedBatch
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.motion.recent import Recent
from odeform.schema import Parameters
from odeform.solver.integrate import SolverSettings
from odeform.types import Floats, Geometry, Times

if TYPE_CHECKING:
    from odeform.models.training.run import Run

__all__ = ["PREFIX", "LatentModel"]

DECODED = 32  # states at once: the features of many more leave the cache
PREFIX = "net."
"""Prefix of the network's arrays in a checkpoint."""


class LatentModel(IntegratedModel):
    """Latent neural ODEs for pose and deformation (the paper's model, one latent state per object)."""

    model = "latent"
    resumable = True
    together = 128
    ablations: ClassVar[Mapping[str, str]] = {
        "ode": "states stay as they start",
        "clock": "decoders are not conditioned on time",
        "parameters": "decoders are not conditioned on parameters",
        "random-features": "decoders have trained features only",
        "correction": "what is left unexplained is not regressed",
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
        self._fields = {dtype: make_field(self.weights, self.config, dtype) for dtype in (np.float32, np.float64)}
        self._batch_fields = {d: make_batch_field(self.weights, self.config, d) for d in (np.float32, np.float64)}
        self.correction = Correction.from_arrays(checkpoint.arrays, self.space.coordinates, self.config.parameters)
        self._pooled: Recent[tuple[EvaluatedBasis, list[Floats]]] = Recent(1)

    def _pool(self, evaluated: EvaluatedBasis) -> list[Floats]:
        def pooled() -> tuple[EvaluatedBasis, list[Floats]]:
            points = evaluated.rest.astype(float) / self.space.gyration_radius
            return evaluated, pool_shape(self.weights, self.config, points, evaluated.shares)

        return self._pooled.get(id(evaluated), pooled)[1]

    def trajectory(
        self, theta: Floats, evaluated: EvaluatedBasis, settings: SolverSettings | None, until: float
    ) -> LatentTrajectory:
        assert settings is not None
        return self.integrate(theta, evaluated, settings, until)

    def problem(self, theta: Floats, evaluated: EvaluatedBasis, dtype: type) -> tuple[Field, Floats, Decoder]:
        decode, correction = self._decoder(theta), self.correction
        if correction is not None:
            decode = _corrected(decode, correction, theta)
        return self._fields[dtype](theta), self._encode(self._pool(evaluated), theta, dtype), decode

    def integrate(
        self, theta: Floats, evaluated: EvaluatedBasis, quality: SolverSettings, until: float
    ) -> LatentTrajectory:
        """The latent motion for theta (P,) in [-1, 1], solved to `until` seconds."""
        field, start, decode = self.problem(theta, evaluated, np.float32 if quality.dtype == "float32" else np.float64)
        fallback = SolverSettings("rk4", step=1.0 / self.schema.window.rate, dtype=quality.dtype)

        def precise() -> tuple[Field, Floats]:
            return self.problem(theta, evaluated, np.float64)[:2]

        return LatentTrajectory(field, decode, start, quality, fallback, until, self.space.gyration_radius, precise)

    def batch_trajectory(
        self, geometry: Geometry, sets: Sequence[Parameters], settings: SolverSettings, until: float
    ) -> SolvedBatch:
        theta, dtype = self.schema.batch_inputs(sets), np.float32 if settings.dtype == "float32" else np.float64
        azimuths = [self.schema.azimuth(each) for each in sets]
        pooled = {azimuth: self._pool(self.evaluate_basis(geometry, azimuth)) for azimuth in dict.fromkeys(azimuths)}
        features = [np.stack(branch) for branch in zip(*(pooled[azimuth] for azimuth in azimuths), strict=True)]

        def readout(times: Times, states: Floats) -> Floats:
            every, clock = np.repeat(theta, len(times), axis=0), np.tile(times, len(theta))
            rows = states.reshape(len(every), -1)
            parts = (slice(begin, begin + DECODED) for begin in range(0, len(every), DECODED))
            y = np.concatenate([self._decoder(every[part])(clock[part], rows[part]) for part in parts])
            y, known = y.reshape(len(theta), len(times), -1), self.correction
            return y if known is None else known.shares * y + known.at(theta, times)

        def make() -> BatchProblem:
            return BatchProblem(self._batch_fields[dtype](theta), self._encode(features, theta, dtype), readout)

        return SolvedBatch(make, settings, until)

    def sensitivities(self, theta: Floats, times: Times, quality: SolverSettings) -> Float[np.ndarray, "jet times y"]:
        """(1 + P, T, 6 + K): the motion y of the trained body under theta (P,) in [-1, 1] at (T,) seconds, and its
        derivatives by each parameter. It does not include what continues the motion beyond the window."""
        body = self.evaluate_basis(self.rest, 0.0)
        clock = self.schema.window.soft_clamped(times)
        jet = self._sensitivities(self._pool(body), theta, quality, clock)
        correction = self.correction
        return jet if correction is None else correction.shares * jet + correction.jet(theta)(clock)

    @cached_property
    def _sensitivities(self) -> Sensitivities:
        return make_sensitivities(self.weights, self.config)


def _corrected(decode: Decoder, correction: Correction, theta: Floats) -> Decoder:
    rest = correction.over_time(theta)
    return lambda times, states: correction.shares * decode(times, states) + rest(times)
