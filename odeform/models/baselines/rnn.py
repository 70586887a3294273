"""A recurrent network, autoregressive in time: from frame to frame, each point from where it was last.

The paper's baseline of that name. A gated recurrent unit (Cho et al. 2014) for each point, with shared weights.
"""

from typing import Any

from odeform.models.baselines.arithmetic import CLOCK, Net, Sizes
from odeform.models.baselines.point_model import PointModel
from odeform.models.baselines.point_network import PointNet, Rows, Trial
from odeform.models.baselines.point_trajectories import FramedPoints

__all__ = ["Rnn", "RnnNet"]


class RnnNet(PointNet):
    """The memory starts from a point and the parameters; each frame it sees the last displacement, and adds to it."""

    teaching = "whole"
    work = 16384
    trials = (Trial(1e-3, 128), Trial(3e-3, 128), Trial(3e-3, 64))

    def sizes(self, parameters: int, width: int) -> Sizes:
        told = 3 + 3 + parameters + CLOCK
        return {
            "start": [3 + parameters, width, width],
            "gates": [width + told, 2 * width],
            "memory": [width + told, width],
            "step": [width, width, 3],
        }

    def predict(self, net: Net, rows: Rows) -> list[Any]:
        known, clock = net.join([rows.x, rows.theta]), net.clock(rows.times)
        memory = net.act("tanh", net.layers("start", known))
        moved = rows.begin
        out = [moved]
        for frame in range(1, len(rows.times)):
            told = net.join([moved, known, clock[frame]])
            gates = net.act("sigmoid", net.layers("gates", net.join([memory, told])))
            width = memory.shape[-1]
            keep, recall = gates[..., :width], gates[..., width:]
            fresh = net.act("tanh", net.layers("memory", net.join([recall * memory, told])))
            memory = keep * memory + (1.0 - keep) * fresh
            # a velocity times the length of the frame: of order one whatever the rate
            length = (rows.times[frame] - rows.times[frame - 1])[..., None]
            moved = moved + length * net.layers("step", memory)
            out.append(moved)
        return [net.stack(out)]


class RnnFrames(FramedPoints):
    """Nothing is known between its frames."""

    solver, between = "recurrent, a frame a step", "linear"


class Rnn(PointModel):
    """Knows its frames alone."""

    model = "rnn"
    network = RnnNet()
    trajectory = RnnFrames
