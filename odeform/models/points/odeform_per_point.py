"""The paper's architecture as its authors released it, with a latent state for every point; trained here.

A global branch carries the offset of the body and a local one the position of each point in it, both by encoder,
neural ODE and decoder. The local field is conditioned on the global state at the first frame after rest, held
constant, as in the released code. Steps are of the 3/8 rule, one per frame.

Differences: points are in units of the body's radius of gyration and times in windows, as in all models here; the
first decoded shape is subtracted, so that P(0) = P0 (the released local decoder predicts the shape itself); and frames
are those of the data, never those of a query. The released encoder of the offset is given where the body starts, which
in these scenes is always the same: zero.
"""

from typing import Any

import numpy as np

from odeform.models.points.arithmetic import Net, Sizes
from odeform.models.points.point_model import PointModel
from odeform.models.points.point_network import PointBatch, PointNet, Trial
from odeform.models.points.point_trajectories import FramedPoints
from odeform.solver.kutta import three_eighths

__all__ = ["OdeformPerPoint", "OdeformPerPointNet"]

OFFSET = 32  # size of the global state
OCTAVES = 6  # of the positional encoding of a point


class OdeformPerPointNet(PointNet):
    """Two branches; `width` is the size of the local latent state, 128 in the released code."""

    sampling = "whole"
    strides = (8, 4, 2)
    work = 1536
    trials = (Trial(3e-4, 128), Trial(1e-3, 128), Trial(3e-3, 128))

    def sizes(self, parameters: int, width: int) -> Sizes:
        def branch(name: str, inputs: int, latent: int, conditions: int) -> dict[str, list[int]]:
            return {
                f"{name}.encoder": [inputs + parameters, 64, 128, 128, latent],
                f"{name}.field": [latent + conditions + 1, *[2 * latent] * 5, latent],
                f"{name}.decoder": [latent, latent, latent // 2, 3],
            }

        return branch("global", 3, OFFSET, 0) | branch("local", 3 + 6 * OCTAVES, width, OFFSET)

    def predict(self, net: Net, batch: PointBatch) -> list[Any]:
        x, theta = batch.x, batch.theta
        waves = [net.act(wave, 2.0**k * np.pi * x) for k in range(OCTAVES) for wave in ("sin", "cos")]
        offset = self._states(net, "global", net.join([0.0 * x, theta]), batch.times, [])
        local = self._states(net, "local", net.join([x, *waves, theta]), batch.times, [offset[1]])
        parts = []
        for name, states, scale in (("global", offset, 1.0), ("local", local, batch.finer)):
            decoded = net.layers(f"{name}.decoder", net.stack(states), "relu")
            parts.append(scale * (decoded - decoded[:1]))
        return parts

    def _states(self, net: Net, name: str, inputs: Any, times: Any, conditions: list[Any]) -> list[Any]:
        """F states (B, latent), by Kutta's 3/8 rule between times (F, B)."""

        def field(state: Any, time: Any) -> Any:
            return net.layers(f"{name}.field", net.join([state, *conditions, time]), "tanh")

        state = net.layers(f"{name}.encoder", inputs, "relu")
        out = [state]
        for begin, end in zip(times[:-1, :, None], times[1:, :, None], strict=True):
            state = three_eighths(field, state, begin, end)
            out.append(state)
        return out


class PerPointFrames(FramedPoints):
    """Integrated and decoded frame by frame."""

    solver, between = "rk4 (3/8 rule)", "cubic"
    stages, doubled = 4, True


class OdeformPerPoint(PointModel):
    """Integrates 128 numbers for each requested point."""

    model = "odeform-per-point"
    network = OdeformPerPointNet()
    trajectory = PerPointFrames
