"""ODeform, ready to predict."""

from functools import cached_property

import numpy as np
from jaxtyping import Float

from odeform.checkpoint import Checkpoint
from odeform.model.base import ReducedModel
from odeform.model.config import ModelConfig
from odeform.model.continuation import ContinuedTrajectory, Dynamics
from odeform.model.inference import (
    Decoder,
    Field,
    LatentTrajectory,
    check_weights,
    make_decoder,
    make_encoder,
    make_field,
    pool_shape,
)
from odeform.model.motion import Trajectory
from odeform.model.placed import PlacedBasis
from odeform.model.reduced import POSE
from odeform.model.sensitivity import Sensitivities, make_sensitivities
from odeform.solver.frontier import FrontierPoint
from odeform.solver.integrate import Quality
from odeform.types import Floats, Times

__all__ = ["ODeform"]

PREFIX = "net."


class ODeform(ReducedModel):
    """Latent neural ODEs for pose and deformation (the paper's model, one state per object)."""

    model = "odeform"

    def _read(self, checkpoint: Checkpoint) -> None:
        super()._read(checkpoint)
        network = checkpoint.config["network"]
        self.config = ModelConfig(**{**network, "decoder_widths": tuple(network["decoder_widths"])})
        self.weights = {k.removeprefix(PREFIX): v for k, v in checkpoint.arrays.items() if k.startswith(PREFIX)}
        check_weights(self.weights, self.config)
        self.qualities = {name: Quality(**setting) for name, setting in checkpoint.config["qualities"].items()}
        self.frontier = tuple(FrontierPoint.from_json(row) for row in checkpoint.config.get("frontier", ()))
        self._encode = make_encoder(self.weights, self.config)
        self._decoder = make_decoder(self.weights, self.config)
        self._fields = {dtype: make_field(self.weights, self.config, dtype) for dtype in (np.float32, np.float64)}
        coordinates = POSE + self.config.modes
        self.dynamics = Dynamics.from_arrays(checkpoint.arrays, coordinates, self.config.parameters)
        self._pooled: tuple[PlacedBasis | None, list[Floats]] = (None, [])

    def _pool(self, placed: PlacedBasis) -> list[Floats]:
        known, pooled = self._pooled
        if known is not placed:
            points = placed.rest.astype(float) / self.space.arm
            pooled = pool_shape(self.weights, self.config, points, placed.shares)
            self._pooled = (placed, pooled)
        return pooled

    def _trajectory(self, theta: Floats, placed: PlacedBasis, quality: Quality | None, until: float) -> Trajectory:
        assert quality is not None
        if self.dynamics is None:
            return self.integrate(theta, placed, quality, until)
        window = self.schema.window
        known = self.integrate(theta, placed, quality, min(until, window.stop))
        return ContinuedTrajectory(known, self.dynamics, theta, window)

    def problem(self, theta: Floats, placed: PlacedBasis, dtype: type) -> tuple[Field, Floats, Decoder]:
        """The initial value problem of parameters in [-1, 1]: field, state at time 0, and the decoder of states."""
        return self._fields[dtype](theta), self._encode(self._pool(placed), theta, dtype), self._decoder(theta)

    def integrate(self, theta: Floats, placed: PlacedBasis, quality: Quality, until: float) -> LatentTrajectory:
        """The solved latent motion for parameters in [-1, 1]."""
        field, start, decode = self.problem(theta, placed, np.float32 if quality.dtype == "float32" else np.float64)
        fallback = Quality("rk4", step=1.0 / self.schema.window.rate, dtype=quality.dtype)
        return LatentTrajectory(field, decode, start, quality, fallback, until, self.space.arm)

    def sensitivities(self, theta: Floats, times: Times, quality: Quality) -> Float[np.ndarray, "jet times y"]:
        """(1 + P, T, 6 + K): the motion y of the trained body under theta (P,) in [-1, 1] at (T,) seconds, and its
        derivatives by each parameter. Not of what is continued beyond the window."""
        body = self.place(self.rest, 0.0)
        return self._sensitivities(self._pool(body), theta, quality, self.schema.window.seen(times))

    @cached_property
    def _sensitivities(self) -> Sensitivities:
        return make_sensitivities(self.weights, self.config)
