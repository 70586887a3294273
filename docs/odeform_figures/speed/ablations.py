"""Ways other than the solver to trade accuracy for speed: the time each saves per frame, and the error it adds."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import KDTree

from odeform.benchmark.probes import round_cloud
from odeform.benchmark.timing import typical
from odeform.models.reduced_model import ReducedModel
from odeform.motion.base import SolveStats
from odeform.motion.evaluated_basis import STILL
from odeform.motion.reduced_motion import ReducedMotion, as_reduced
from odeform.motion.reduced_space import POSE
from odeform.motion.trajectory import Trajectory
from odeform.types import Floats

__all__ = ["ablations", "with_modes"]

POINTS = 20_000
FRAMES = 20
DECIMATION = 4


@dataclass(frozen=True)
class _Shortened(Trajectory):
    """A trajectory without its last modes."""

    whole: Trajectory
    modes: int

    @property
    def stats(self) -> SolveStats:
        return self.whole.stats

    @property
    def last_good(self) -> float:
        return self.whole.last_good

    def reduced(self, times: Floats) -> Floats:
        return self.whole.reduced(times)[:, : POSE + self.modes]


def with_modes(motion: ReducedMotion, modes: int) -> ReducedMotion:
    """The motion with the first `modes` of its modes; with none it is rigid."""
    evaluated = replace(
        motion.evaluated, rows=motion.evaluated.rows[: STILL + modes], reach=motion.evaluated.reach[:modes]
    )
    shortened = _Shortened(motion.trajectory, modes)
    return replace(motion, evaluated=evaluated, trajectory=shortened, body=None)


def _interpolated(coarse: Floats, coarse_rest: Floats, rest: Floats) -> Floats:
    """(T, M, 3), (M, 3), (N, 3) m -> (T, N, 3) m: points follow the nearest three, weighted by inverse distance."""
    distance, index = KDTree(coarse_rest).query(rest, k=3)
    weights = 1.0 / np.maximum(distance, 1e-9)
    weights /= weights.sum(axis=1, keepdims=True)
    return rest + np.einsum("tnkj,nk->tnj", (coarse - coarse_rest)[:, index], weights)


def ablations(predictor: ReducedModel) -> list[dict[str, Any]]:
    """Measures one row per ablation: its name, ms per frame, ms saved per frame, and added RMS error in mm."""
    shape = round_cloud(POINTS, predictor)
    motion = as_reduced(predictor.solve(shape))
    window = predictor.schema.window
    times = np.linspace(window.start, window.stop, FRAMES)
    moments = np.random.default_rng(3).uniform(window.start, window.stop, 40)
    truth = motion.vertices(times).astype(float)

    def row(name: str, work: Any, frames: Floats) -> dict[str, Any]:
        ms = typical(lambda i: work(float(moments[i % len(moments)])), len(moments))
        error = float(1e3 * np.sqrt(((frames - truth) ** 2).mean()))
        return {"ablation": name, "points": POINTS, "ms": ms, "saves_ms": whole - ms, "error_mm": error}

    whole = typical(lambda i: motion.vertices(float(moments[i % len(moments)])), len(moments))
    rows, modes = [], len(motion.evaluated.values)
    for kept in dict.fromkeys(max(modes // part, 1) for part in (2, 4, 8)):
        fewer = with_modes(motion, kept)
        rows.append(row(f"{kept} of {modes} modes", fewer.vertices, fewer.vertices(times)))
    # without deformation a frame is a pose, which the renderer applies
    rigid = with_modes(motion, 0)
    rows.append(row("no deformation: one pose per frame", rigid.pose, rigid.vertices(times)))
    few = round_cloud(POINTS // DECIMATION, predictor)
    decimated = as_reduced(predictor.solve(few))
    interpolated = _interpolated(decimated.vertices(times), few.points, shape.points)
    rows.append(row(f"1/{DECIMATION} of the points, the others interpolated", decimated.vertices, interpolated))

    def halved(time: float | Floats) -> Floats:
        return motion.vertices(time).astype(np.float16)

    rows.append(row("float16 vertices: half the bytes", halved, halved(times)))
    return rows
