"""A continuous velocity field over space and time between frames that are given (Occupancy Flow, Niemeyer et al. 2019).

As in the paper's comparison it is given every k-th frame of a motion, at test time too, and says what is between. It
sees no parameters. A point flows forward from the given frame before and backward from the one after; the two are
blended, so that the motion is that of the given frames there.

What differs from Niemeyer et al.: frames come with the correspondence of their vertices, so the code that their
encoder makes of unordered clouds is here what the given frames say of the point itself, which is more. Points that are
no vertices are given what a smooth field through the vertices says (as `odeform.motion.basis`). Training uses what lies
between the given frames of training sequences, as the field would have nothing to learn from otherwise.
"""

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

from odeform.checkpoint import Checkpoint
from odeform.errors import InputError
from odeform.models.baselines.arithmetic import CLOCK, Net, Sizes
from odeform.models.baselines.point_model import PointModel
from odeform.models.baselines.point_network import PointNet, Rows, Trial
from odeform.models.baselines.point_trajectories import FramedPoints
from odeform.motion.basis import fit_basis
from odeform.motion.point_motion import PointFrame
from odeform.motion.reduced_space import to_canonical
from odeform.schema import Parameters, Window
from odeform.types import Frames, MotionSequence, Points, Times

__all__ = ["BetweenGiven", "OccupancyFlow", "OccupancyFlowNet", "told"]

TOLD = 13  # numbers of `told`
POINTS = 64  # that flow at once, through all intervals
Given = Float[np.ndarray, "given points 3"]


def told(net: Net, given: list[Any], length: Any) -> Any:
    """Displacements (..., 3) at the given frames before, at the start, at the end and after an interval of `length`
    (..., 1) windows -> (..., TOLD): its mean velocities, where it starts, and its length."""
    before, start, end, after = given
    return net.join([(start - before) / length, (end - start) / length, (after - end) / length, start, length])


class OccupancyFlowNet(PointNet):
    """A field of four linear layers, bounded by tanh but for the mean velocity between two given frames; classic
    Runge-Kutta steps of a frame of the data. `Rows.theta` is `told`, `Rows.times` go from 0 to 1 in the interval."""

    teaching = "between"
    trials = (Trial(1e-3, 128), Trial(3e-3, 128), Trial(3e-3, 192))

    def sizes(self, parameters: int, width: int) -> Sizes:
        return {"field": [3 + 3 + TOLD + CLOCK, width, width, width, 3]}

    def predict(self, net: Net, rows: Rows) -> list[Any]:
        start, length, straight = rows.theta[..., 9:12], rows.theta[..., 12:13], rows.theta[..., 3:6]
        end = start + length * straight
        forward = self._flow(net, rows, start, rows.times)
        backward = self._flow(net, rows, end, 1.0 - rows.times)
        share = rows.times[..., None]
        # the backward one has passed the moments in the opposite order
        flipped = net.stack(backward[::-1])
        return [(1.0 - share) * net.stack(forward) + share * flipped]

    def _flow(self, net: Net, rows: Rows, moved: Any, times: Any) -> list[Any]:
        """F displacements (B, 3) from `moved` on, at `times` (F, B) in the interval, which may fall."""
        start, length, straight = rows.theta[..., 9:12], rows.theta[..., 12:13], rows.theta[..., 3:6]

        def field(moved: Any, time: Any) -> Any:
            """Displacement per interval."""
            place = (moved - start) / length
            seen = net.join([place, rows.x, rows.theta, net.clock(time)])
            return length * (straight + net.layers("field", seen, "tanh"))

        out = [moved]
        for begin, end in itertools.pairwise(times):
            step, middle = (end - begin)[..., None], 0.5 * (begin + end)
            k1 = field(moved, begin)
            k2 = field(moved + 0.5 * step * k1, middle)
            k3 = field(moved + 0.5 * step * k2, middle)
            k4 = field(moved + step * k3, end)
            moved = moved + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            out.append(moved)
        return out


class BetweenGiven(FramedPoints):
    """Displacements between `given` ones: (G, N, 3) in units of the data's scale, every `every` frames of `window`.

    After the last of them it holds that.
    """

    solver, between = "rk4, both ways between given frames", "cubic"
    stages = 8

    def __init__(
        self, net: Net, network: PointNet, frame: PointFrame, window: Window, x: Points, given: Given, every: int
    ) -> None:
        super().__init__(net, network, frame, window, x, np.zeros(0))
        self._given, self._every = given, every

    def _roll_out(self, grid: Times) -> Frames:
        count, intervals = len(self._x), len(self._given) - 1
        out = np.repeat(self._given[-1:], max(len(grid), intervals * self._every + 1), axis=0)
        for begin in range(0, count, POINTS):
            x = self._x[begin : begin + POINTS]
            flown = self._flown(x, self._given[:, begin : begin + POINTS])
            out[: intervals * self._every, begin : begin + POINTS] = flown
        return out[: len(grid)] * np.float32(self._frame.scale)

    def _flown(self, x: Points, given: Given) -> Frames:
        """(G - 1) times `every` frames of the points x (n, 3), the last given one left out."""
        intervals, every = len(given) - 1, self._every
        ends = np.arange(intervals)
        four = [given[np.clip(ends + shift, 0, intervals)].reshape(-1, 3) for shift in (-1, 0, 1, 2)]
        length = np.full((len(four[0]), 1), every / (len(self._window.times) - 1), dtype=np.float32)
        times = np.arange(every + 1, dtype=np.float32)[:, None] / np.float32(every)
        rows = Rows(
            x=np.tile(x, (intervals, 1)),
            theta=told(self._net, four, length),
            times=np.broadcast_to(times, (every + 1, len(length))),
            begin=four[1],
            finer=1.0,
        )
        moved = self._network.predict(self._net, rows)[0][:-1].reshape(every, intervals, len(x), 3)
        return moved.swapaxes(0, 1).reshape(-1, len(x), 3)


class OccupancyFlow(PointModel):
    """Moves between observed frames; the rate of its window is theirs."""

    model = "occupancy-flow"
    network = OccupancyFlowNet()

    def _read(self, checkpoint: Checkpoint) -> None:
        super()._read(checkpoint)
        self._every = int(checkpoint.config["every"])

    def _trajectory(self, rest: Points, parameters: Parameters, observed: MotionSequence | None) -> BetweenGiven:
        assert observed is not None
        given = self._given(rest, parameters, observed) / np.float32(self.frame.scale)
        fine = replace(self.schema.window, rate=self.schema.window.rate * self._every)
        return BetweenGiven(self.net, self.network, self.frame, fine, self.frame.seen(rest), given, self._every)

    def _given(self, rest: Points, parameters: Parameters, observed: MotionSequence) -> Given:
        """(G, N, 3) metres, canonical, from the mean motion: what the observed vertices say of points `rest` (N, 3)."""
        times, window = observed.times, self.schema.window
        if len(times) < 2 or not np.allclose(times, window.start + np.arange(len(times)) / window.rate, atol=1e-6):
            raise InputError(
                f"{self.model}: expected observed frames from {window.start:g} s on, {window.rate:g} a second"
            )
        frames = to_canonical(observed.vertices, np.array(self.frame.anchor), self.schema.azimuth(parameters))
        basis = fit_basis(frames[0], (frames - frames[0]).transpose(1, 2, 0), self.frame.gyration_radius)
        return basis.values(rest).transpose(2, 0, 1) - self.mean.at(times)[:, None].astype(np.float32)
