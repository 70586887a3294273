"""A network (x, theta, t) -> displacement: nothing is integrated, and times are independent of each other."""

from typing import Any

from odeform.models.points.arithmetic import CLOCK, Net, Sizes
from odeform.models.points.point_model import PointModel
from odeform.models.points.point_network import PointBatch, PointNet, Trial
from odeform.models.points.point_trajectories import MomentaryPoints

__all__ = ["Direct", "DirectNet"]

EARLY = 100.0  # slope of the ramp from rest, per window: it takes about a frame


class DirectNet(PointNet):
    """Five linear layers on a point, parameters and features of the time, times a ramp that is 0 at rest."""

    sampling = "moments"
    trials = (Trial(1e-3, 192), Trial(3e-3, 192), Trial(1e-3, 320))

    def sizes(self, parameters: int, width: int) -> Sizes:
        return {"field": [3 + parameters + CLOCK, width, width, width, width, 3]}

    def predict(self, net: Net, batch: PointBatch) -> list[Any]:
        ramp = net.act("tanh", EARLY * batch.times[..., None])
        # a single row of times (1, B), one for each point: in predictions there is a point for each time
        inputs = net.join([batch.x, batch.theta, net.clock(batch.times[0])])
        return [ramp * net.layers("field", inputs)]


class Direct(PointModel):
    """Evaluates any time independently."""

    model = "direct"
    network = DirectNet()
    trajectory = MomentaryPoints
