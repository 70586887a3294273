"""A continuous velocity field over space and time between observed frames (Occupancy Flow, Niemeyer et al. 2019).

As in the paper's comparison the model observes every k-th frame of a motion, at test time too, and predicts those in
between. It uses no parameters. A point flows forward from the observed frame before and backward from the one after;
the two are blended, so that the motion passes through the observed frames.

Differences to Niemeyer et al.: observed frames come with the correspondence of their vertices, so that the field is
conditioned on the motion of the point itself, which is more than a code that an encoder computes from unordered point
clouds. Points that are not vertices are carried by a smooth field through the vertices (as `odeform.motion.basis`).
Training uses the frames between the observed ones of training sequences: the field has nothing else to learn from.
"""

import itertools
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from odeform.checkpoint import Checkpoint
from odeform.errors import InputError
from odeform.models.points.arithmetic import CLOCK, Net, Sizes
from odeform.models.points.point_model import PointModel
from odeform.models.points.point_network import PointBatch, PointNet, Trial
from odeform.models.points.point_trajectories import FramedPoints
from odeform.motion.basis import fit_basis
from odeform.motion.point_motion import PointFrame
from odeform.motion.reduced_space import to_canonical
from odeform.schema import Parameters, Window
from odeform.solver.kutta import classic
from odeform.types import Frames, MotionSequence, Points, Times

__all__ = ["BetweenObserved", "OccupancyFlow", "OccupancyFlowNet", "conditioning"]

TOGETHER = 64  # points that flow at once, through all intervals
Observed = Float[np.ndarray, "observed points 3"]


class Interval(NamedTuple):
    """The columns of what the network is conditioned on: an interval between two observed frames.

    Velocities (..., 3) are in units of the data's scale per window, `start` (..., 3) in those units, and the `length`
    (..., 1) in windows.
    """

    velocity_before: Any
    velocity: Any
    velocity_after: Any
    start: Any
    length: Any

    @classmethod
    def of(cls, columns: Any) -> "Interval":
        """Splits columns (..., 13), as `conditioning` joins them."""
        begins = np.cumsum([0, *WIDTHS])
        return cls(*(columns[..., begin:end] for begin, end in itertools.pairwise(begins)))


WIDTHS = Interval(3, 3, 3, 3, 1)


def conditioning(net: Net, observed: list[Any], length: Any) -> Any:
    """Displacements (..., 3) at the observed frames before, at the start, at the end and after an interval of `length`
    (..., 1) windows -> (..., 13): an `Interval`, joined."""
    before, start, end, after = observed
    velocities = (start - before) / length, (end - start) / length, (after - end) / length
    return net.join([*Interval(*velocities, start, length)])


class OccupancyFlowNet(PointNet):
    """A field of four linear layers, bounded by tanh except for the mean velocity between the two observed frames; one
    classic Runge-Kutta step per frame of the data. `PointBatch.theta` is `conditioning`, its times go from 0 to 1 in
    the interval."""

    sampling = "between"
    trials = (Trial(1e-3, 128), Trial(3e-3, 128), Trial(3e-3, 192))

    def sizes(self, parameters: int, width: int) -> Sizes:
        return {"field": [3 + 3 + sum(WIDTHS) + CLOCK, width, width, width, 3]}

    def predict(self, net: Net, batch: PointBatch) -> list[Any]:
        interval = Interval.of(batch.theta)
        end = interval.start + interval.length * interval.velocity
        forward = self._flow(net, batch, interval.start, batch.times)
        backward = self._flow(net, batch, end, 1.0 - batch.times)
        fraction = batch.times[..., None]
        # the backward flow passed the times in the opposite order
        flipped = net.stack(backward[::-1])
        return [(1.0 - fraction) * net.stack(forward) + fraction * flipped]

    def _flow(self, net: Net, batch: PointBatch, moved: Any, times: Any) -> list[Any]:
        """F displacements (B, 3) from `moved` on, at `times` (F, B) in the interval, which may decrease."""
        interval = Interval.of(batch.theta)

        def field(moved: Any, time: Any) -> Any:
            """Displacement per interval."""
            relative = (moved - interval.start) / interval.length
            inputs = net.join([relative, batch.x, batch.theta, net.clock(time)])
            return interval.length * (interval.velocity + net.layers("field", inputs, "tanh"))

        out = [moved]
        for begin, end in itertools.pairwise(times):
            moved = classic(field, moved, (end - begin)[..., None], begin, 0.5 * (begin + end), end)
            out.append(moved)
        return out


class BetweenObserved(FramedPoints):
    """Displacements between `observed` ones: (G, N, 3) in units of the data's scale, every `every` frames of `window`.

    After the last of them it holds that one.
    """

    solver, between = "rk4, both ways between observed frames", "cubic"
    stages = 8

    def __init__(
        self, net: Net, network: PointNet, frame: PointFrame, window: Window, x: Points, observed: Observed, every: int
    ) -> None:
        super().__init__(net, network, frame, window, x, np.zeros(0))
        self._observed, self._every = observed, every

    def _roll_out(self, grid: Times) -> Frames:
        count, intervals = len(self._x), len(self._observed) - 1
        out = np.repeat(self._observed[-1:], max(len(grid), intervals * self._every + 1), axis=0)
        for begin in range(0, count, TOGETHER):
            some = slice(begin, begin + TOGETHER)
            out[: intervals * self._every, some] = self._flown(self._x[some], self._observed[:, some])
        return out[: len(grid)] * np.float32(self._frame.scale)

    def _flown(self, x: Points, observed: Observed) -> Frames:
        """(G - 1) times `every` frames of the points x (n, 3), without the last observed one."""
        intervals, every = len(observed) - 1, self._every
        starts = np.arange(intervals)
        four = [observed[np.clip(starts + shift, 0, intervals)].reshape(-1, 3) for shift in (-1, 0, 1, 2)]
        length = np.full((len(four[0]), 1), every / (len(self._window.times) - 1), dtype=np.float32)
        times = np.arange(every + 1, dtype=np.float32)[:, None] / np.float32(every)
        batch = PointBatch(
            x=np.tile(x, (intervals, 1)),
            theta=conditioning(self._net, four, length),
            times=np.broadcast_to(times, (every + 1, len(length))),
            begin=four[1],
            finer=1.0,
        )
        moved = self._network.predict(self._net, batch)[0][:-1].reshape(every, intervals, len(x), 3)
        return moved.swapaxes(0, 1).reshape(-1, len(x), 3)


class OccupancyFlow(PointModel):
    """Interpolates between observed frames, whose rate is that of its window."""

    model = "occupancy-flow"
    network = OccupancyFlowNet()

    def _read(self, checkpoint: Checkpoint) -> None:
        super()._read(checkpoint)
        self._every = int(checkpoint.config["every"])

    def _trajectory(self, rest: Points, parameters: Parameters, observed: MotionSequence | None) -> BetweenObserved:
        assert observed is not None
        displacements = self._observed(rest, parameters, observed) / np.float32(self.frame.scale)
        fine = replace(self.schema.window, rate=self.schema.window.rate * self._every)
        inputs = self.frame.inputs(rest)
        return BetweenObserved(self.net, self.network, self.frame, fine, inputs, displacements, self._every)

    def _observed(self, rest: Points, parameters: Parameters, observed: MotionSequence) -> Observed:
        """(G, N, 3) metres from the mean motion, canonical: where the observed vertices carry points `rest` (N, 3)."""
        times, window = observed.times, self.schema.window
        if len(times) < 2 or not np.allclose(times, window.start + np.arange(len(times)) / window.rate, atol=1e-6):
            raise InputError(
                f"{self.model}: expected observed frames from {window.start:g} s on, {window.rate:g} per second"
            )
        frames = to_canonical(observed.vertices, np.array(self.frame.anchor), self.schema.azimuth(parameters))
        basis = fit_basis(frames[0], (frames - frames[0]).transpose(1, 2, 0), self.frame.gyration_radius)
        return basis.values(rest).transpose(2, 0, 1) - self.mean.at(times)[:, None].astype(np.float32)
