"""A neural ODE on the points themselves: du/dt = f(u, x, theta, t), without a latent encoding.

The paper's baseline nODE (Chen et al. 2018). The state of a point is its displacement alone.
"""

from typing import Any

from odeform.models.baselines.arithmetic import CLOCK, Net, Sizes
from odeform.models.baselines.point_model import PointModel
from odeform.models.baselines.point_network import PointNet, Rows, Trial
from odeform.models.baselines.point_trajectories import FramedPoints

__all__ = ["Node", "NodeNet"]


class NodeNet(PointNet):
    """A field of four linear layers, bounded by tanh; one classic Runge-Kutta step a frame."""

    teaching = "segments"
    trials = (Trial(1e-3, 128), Trial(3e-3, 128), Trial(3e-3, 192))

    def sizes(self, parameters: int, width: int) -> Sizes:
        return {"field": [3 + 3 + parameters + CLOCK, width, width, width, 3]}

    def predict(self, net: Net, rows: Rows) -> list[Any]:
        known, times = net.join([rows.x, rows.theta]), rows.times
        on, halfway = net.clock(times), net.clock(0.5 * (times[1:] + times[:-1]))

        def field(moved: Any, clock: Any) -> Any:
            return net.layers("field", net.join([moved, known, clock]), "tanh")

        moved = rows.begin
        out = [moved]
        for frame in range(len(times) - 1):
            length = (times[frame + 1] - times[frame])[..., None]
            k1 = field(moved, on[frame])
            k2 = field(moved + 0.5 * length * k1, halfway[frame])
            k3 = field(moved + 0.5 * length * k2, halfway[frame])
            k4 = field(moved + length * k3, on[frame + 1])
            moved = moved + length / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            out.append(moved)
        return [net.stack(out)]


class NodeFrames(FramedPoints):
    """Integrated from frame to frame."""

    solver, between = "rk4", "cubic"
    stages, doubled = 4, True


class Node(PointModel):
    """Integrated from frame to frame, whatever is asked."""

    model = "node"
    network = NodeNet()
    trajectory = NodeFrames
