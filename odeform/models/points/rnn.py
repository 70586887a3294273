"""A recurrent network, autoregressive in time: each frame of a point follows from the frame before.

The paper's baseline of that name. A gated recurrent unit (Cho et al. 2014) for each point, with shared weights.
"""

from typing import Any

from odeform.models.points.arithmetic import CLOCK, Net, Sizes
from odeform.models.points.point_model import PointModel
from odeform.models.points.point_network import PointBatch, PointNet, Trial
from odeform.models.points.point_trajectories import FramedPoints

__all__ = ["Rnn", "RnnNet"]


class RnnNet(PointNet):
    """The memory starts from the point and the parameters; in each frame it reads the last displacement and adds to
    it."""

    sampling = "whole"
    work = 16384
    trials = (Trial(1e-3, 128), Trial(3e-3, 128), Trial(3e-3, 64))

    def sizes(self, parameters: int, width: int) -> Sizes:
        inputs = 3 + 3 + parameters + CLOCK
        return {
            "start": [3 + parameters, width, width],
            "gates": [width + inputs, 2 * width],
            "memory": [width + inputs, width],
            "step": [width, width, 3],
        }

    def predict(self, net: Net, batch: PointBatch) -> list[Any]:
        conditions, clock = net.join([batch.x, batch.theta]), net.clock(batch.times)
        memory = net.act("tanh", net.layers("start", conditions))
        moved = batch.begin
        out = [moved]
        for frame in range(1, len(batch.times)):
            inputs = net.join([moved, conditions, clock[frame]])
            gates = net.act("sigmoid", net.layers("gates", net.join([memory, inputs])))
            width = memory.shape[-1]
            keep, recall = gates[..., :width], gates[..., width:]
            fresh = net.act("tanh", net.layers("memory", net.join([recall * memory, inputs])))
            memory = keep * memory + (1.0 - keep) * fresh
            # a velocity times the length of the frame: of order one at any frame rate
            length = (batch.times[frame] - batch.times[frame - 1])[..., None]
            moved = moved + length * net.layers("step", memory)
            out.append(moved)
        return [net.stack(out)]


class RnnFrames(FramedPoints):
    """Linear between frames: the network knows nothing in between."""

    solver, between = "recurrent, one frame per step", "linear"


class Rnn(PointModel):
    """Predicts frames only; times in between are interpolated."""

    model = "rnn"
    network = RnnNet()
    trajectory = RnnFrames
