"""ODeform, ready to predict."""

import numpy as np

from odeform.checkpoint import Checkpoint
from odeform.model.base import ReducedModel
from odeform.model.config import ModelConfig
from odeform.model.inference import (
    Field,
    LatentTrajectory,
    check_weights,
    make_decoder,
    make_encoder,
    make_field,
    pool_shape,
)
from odeform.model.placed import PlacedBasis
from odeform.solver.frontier import FrontierPoint
from odeform.solver.integrate import Quality
from odeform.types import Floats

__all__ = ["ODeform"]

PREFIX = "net."


class ODeform(ReducedModel):
    """Latent neural ODEs for pose and deformation (the paper's model, one state per object)."""

    model = "odeform"

    def _read(self, checkpoint: Checkpoint) -> None:
        network = checkpoint.config["network"]
        self.config = ModelConfig(**{**network, "decoder_widths": tuple(network["decoder_widths"])})
        self.weights = {k.removeprefix(PREFIX): v for k, v in checkpoint.arrays.items() if k.startswith(PREFIX)}
        check_weights(self.weights, self.config)
        self.qualities = {name: Quality(**setting) for name, setting in checkpoint.config["qualities"].items()}
        self.frontier = tuple(FrontierPoint.from_json(row) for row in checkpoint.config.get("frontier", ()))
        self._encode = make_encoder(self.weights, self.config)
        self._decoder = make_decoder(self.weights, self.config)
        self._fields = {dtype: make_field(self.weights, self.config, dtype) for dtype in (np.float32, np.float64)}
        self._pooled: tuple[PlacedBasis | None, list[Floats]] = (None, [])

    def _pool(self, placed: PlacedBasis) -> list[Floats]:
        known, pooled = self._pooled
        if known is not placed:
            points = placed.rest.astype(float) / self.space.arm
            pooled = pool_shape(self.weights, self.config, points, placed.shares)
            self._pooled = (placed, pooled)
        return pooled

    def _trajectory(
        self, theta: Floats, placed: PlacedBasis, quality: Quality | None, until: float
    ) -> LatentTrajectory:
        assert quality is not None
        return self.integrate(theta, placed, quality, until)

    def flow(self, theta: Floats, placed: PlacedBasis, precision: str) -> tuple[Field, Floats]:
        """What is integrated: the field dz/dt = f(t, z), and the latent state (S,) at rest."""
        dtype = np.float32 if precision == "float32" else np.float64
        return self._fields[dtype](theta), self._encode(self._pool(placed), theta, dtype)

    def integrate(self, theta: Floats, placed: PlacedBasis, quality: Quality, until: float) -> LatentTrajectory:
        """The solved latent motion for parameters in [-1, 1]."""
        field, start = self.flow(theta, placed, quality.dtype)
        fallback = Quality("rk4", step=1.0 / self.schema.window.rate, dtype=quality.dtype)
        return LatentTrajectory(field, self._decoder(theta), start, quality, fallback, until, self.space.arm)
