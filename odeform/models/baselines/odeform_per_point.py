"""The paper's architecture as its authors released it: a latent state for every point; trained here.

A global branch carries the offset of the body and a local one each point's place in it, both by encoder, neural ODE and
decoder. The local field sees the global state at the first frame after rest, held constant, as the released one does.
Steps are of the 3/8 rule, one a frame.

What differs: points are in units of the body's arm and times in windows, as in all models here; the first decoded
shape is taken off, so that P(0) = P0 (the released local decoder gives the shape itself); and frames are the data's,
never those of a query. The released encoder of the offset sees where the body starts, which in these scenes is always
the same: zero.
"""

from typing import Any

import numpy as np

from odeform.models.baselines.arithmetic import Net, Sizes
from odeform.models.baselines.point_model import PointModel
from odeform.models.baselines.point_network import PointNet, Rows, Trial
from odeform.models.baselines.point_trajectories import FramedPoints
from odeform.solver.kutta import three_eighths

__all__ = ["OdeformPerPoint", "OdeformPerPointNet"]

OFFSET = 32  # numbers of the global state
OCTAVES = 6  # of the positional encoding of a point


class OdeformPerPointNet(PointNet):
    """Two branches; `width` is that of the local latent, released with 128."""

    teaching = "whole"
    strides = (8, 4, 2)
    work = 1536
    trials = (Trial(3e-4, 128), Trial(1e-3, 128), Trial(3e-3, 128))

    def sizes(self, parameters: int, width: int) -> Sizes:
        def branch(name: str, seen: int, latent: int, told: int) -> dict[str, list[int]]:
            return {
                f"{name}.encoder": [seen + parameters, 64, 128, 128, latent],
                f"{name}.field": [latent + told + 1, *[2 * latent] * 5, latent],
                f"{name}.decoder": [latent, latent, latent // 2, 3],
            }

        return branch("global", 3, OFFSET, 0) | branch("local", 3 + 6 * OCTAVES, width, OFFSET)

    def predict(self, net: Net, rows: Rows) -> list[Any]:
        x, theta = rows.x, rows.theta
        waves = [net.act(wave, 2.0**k * np.pi * x) for k in range(OCTAVES) for wave in ("sin", "cos")]
        offset = self._states(net, "global", net.join([0.0 * x, theta]), rows.times, [])
        local = self._states(net, "local", net.join([x, *waves, theta]), rows.times, [offset[1]])
        parts = []
        for name, states, scale in (("global", offset, 1.0), ("local", local, rows.finer)):
            decoded = net.layers(f"{name}.decoder", net.stack(states), "relu")
            parts.append(scale * (decoded - decoded[:1]))
        return parts

    def _states(self, net: Net, name: str, seen: Any, times: Any, told: list[Any]) -> list[Any]:
        """F states (B, latent), by Kutta's 3/8 rule between times (F, B)."""

        def field(state: Any, time: Any) -> Any:
            return net.layers(f"{name}.field", net.join([state, *told, time]), "tanh")

        state = net.layers(f"{name}.encoder", seen, "relu")
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
    """Integrates 128 numbers for each point that is asked for."""

    model = "odeform-per-point"
    network = OdeformPerPointNet()
    trajectory = PerPointFrames
