"""A neural ODE on the points themselves: du/dt = f(u, x, theta, t), without a latent encoding.

The paper's baseline nODE (Chen et al. 2018). The state of a point is its displacement.
"""

from typing import Any

from odeform.models.points.arithmetic import CLOCK, Net, Sizes
from odeform.models.points.point_model import PointModel
from odeform.models.points.point_network import PointBatch, PointNet, Trial
from odeform.models.points.point_trajectories import FramedPoints
from odeform.solver.kutta import classic

__all__ = ["Node", "NodeNet"]


class NodeNet(PointNet):
    """A field of four linear layers, bounded by tanh; one classic Runge-Kutta step per frame."""

    sampling = "segments"
    trials = (Trial(1e-3, 128), Trial(3e-3, 128), Trial(3e-3, 192))

    def sizes(self, parameters: int, width: int) -> Sizes:
        return {"field": [3 + 3 + parameters + CLOCK, width, width, width, 3]}

    def predict(self, net: Net, batch: PointBatch) -> list[Any]:
        conditions, times = net.join([batch.x, batch.theta]), batch.times
        on, halfway = net.clock(times), net.clock(0.5 * (times[1:] + times[:-1]))

        def field(moved: Any, clock: Any) -> Any:
            return net.layers("field", net.join([moved, conditions, clock]), "tanh")

        moved = batch.begin
        out = [moved]
        for frame in range(len(times) - 1):
            length = (times[frame + 1] - times[frame])[..., None]
            moved = classic(field, moved, length, on[frame], halfway[frame], on[frame + 1])
            out.append(moved)
        return [net.stack(out)]


class NodeFrames(FramedPoints):
    """Integrated from frame to frame."""

    solver, between = "rk4", "cubic"
    stages, doubled = 4, True


class Node(PointModel):
    """Integrates each point from frame to frame; times in between are interpolated."""

    model = "node"
    network = NodeNet()
    trajectory = NodeFrames
