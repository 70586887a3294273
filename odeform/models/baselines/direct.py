"""A network (x, theta, t) -> displacement: nothing is integrated, and nothing ties a moment to the next."""

from typing import Any

from odeform.models.baselines.arithmetic import CLOCK, Net, Sizes
from odeform.models.baselines.point_model import PointModel
from odeform.models.baselines.point_network import PointNet, Rows, Trial
from odeform.models.baselines.point_trajectories import MomentaryPoints

__all__ = ["Direct", "DirectNet"]

EARLY = 100.0  # of the ramp from rest, in one over a window: about a frame


class DirectNet(PointNet):
    """Five linear layers on a point, parameters and features of the time, times a ramp that is 0 at rest."""

    teaching = "moments"
    trials = (Trial(1e-3, 192), Trial(3e-3, 192), Trial(1e-3, 320))

    def sizes(self, parameters: int, width: int) -> Sizes:
        return {"field": [3 + parameters + CLOCK, width, width, width, width, 3]}

    def predict(self, net: Net, rows: Rows) -> list[Any]:
        ramp = net.act("tanh", EARLY * rows.times[..., None])
        # one row of times for each point: (1, B) in training, and in predictions as many points as there are moments
        told = net.join([rows.x, rows.theta, net.clock(rows.times[0])])
        return [ramp * net.layers("field", told)]


class Direct(PointModel):
    """Asked for any moment by itself."""

    model = "direct"
    network = DirectNet()
    trajectory = MomentaryPoints
