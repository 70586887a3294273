"""What the user wishes, and what is then to be seen. Knows predictors and motions, no GUI types."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from odeform.errors import InputError
from odeform.model.motion import Motion, SolveStats
from odeform.predictor import Predictor
from odeform.schema import Schema
from odeform.types import Floats, GaussianSplats, Geometry

__all__ = ["Column", "ColumnFrame", "Frame", "Session", "Wish", "same_motions"]

INVISIBLE = 5e-5  # m; a deformation below this cannot be seen on a ball of 0.1 m at any sensible zoom


@dataclass(frozen=True)
class Wish:
    """Everything that decides what is shown."""

    parameters: Mapping[str, float]
    time: float
    quality: str
    visible: tuple[bool, ...]


@dataclass(frozen=True, eq=False)
class Column:
    """One model beside the others."""

    label: str
    predictor: Predictor
    geometry: Geometry


@dataclass(frozen=True, eq=False)
class ColumnFrame:
    """One column at one moment: the `pose` (4, 4), and what it moves.

    `points` (N, 3) is the body deformed where it rests, `covariances` (N, 3, 3) in m^2 those of its splats, if it is
    made of any; None where the deformation is too small to be seen, and the pose says it all.
    """

    motion: Motion
    points: Floats | None
    covariances: Floats | None
    pose: Floats

    @property
    def stats(self) -> SolveStats:
        return self.motion.stats


@dataclass(frozen=True, eq=False)
class Frame:
    """All visible columns at one moment, in the order of the session's columns; None for hidden ones."""

    wish: Wish
    columns: tuple[ColumnFrame | None, ...]


def same_motions(one: Frame, other: Frame) -> bool:
    """Whether two frames differ in time alone."""
    pairs = zip(one.columns, other.columns, strict=True)
    return all(a is None or (b is not None and a.motion is b.motion) for a, b in pairs)


class Session:
    """Columns under one set of parameters and one time. Integrates only when parameters or quality change."""

    def __init__(self, columns: Sequence[Column]) -> None:
        first = columns[0].predictor.schema
        for column in columns[1:]:
            if column.predictor.schema.scene != first.scene:
                raise InputError(
                    f"cannot compare {column.label}: it is of scene {column.predictor.schema.scene}, not {first.scene}"
                )
        self.columns = tuple(columns)
        self.schema: Schema = first
        self._motions: dict[int, tuple[tuple[object, ...], Motion]] = {}

    @property
    def qualities(self) -> tuple[str, ...]:
        """Names that any of the columns can be solved with."""
        names = [name for column in self.columns for name in column.predictor.qualities]
        return tuple(dict.fromkeys(names))

    def motion(self, index: int, wish: Wish) -> Motion:
        """The motion of one column; the same object until parameters or quality change."""
        column = self.columns[index]
        names = {p.name for p in column.predictor.schema.parameters}
        parameters = {name: value for name, value in wish.parameters.items() if name in names}
        key = (wish.quality, *sorted(parameters.items()))
        if index not in self._motions or self._motions[index][0] != key:
            motion = column.predictor.solve(column.geometry, parameters, wish.quality)
            self._motions[index] = (key, motion)
        return self._motions[index][1]

    def frame(self, wish: Wish) -> Frame:
        """What is to be seen; only visible columns are computed. `InputError` for wishes that no motion can meet."""
        if not np.isfinite(wish.time) or wish.time < 0.0:
            raise InputError(f"time: expected seconds from 0 on, got {wish.time}")
        columns = [
            self._column(self.motion(index, wish), wish.time) if visible else None
            for index, visible in enumerate(wish.visible)
        ]
        return Frame(wish, tuple(columns))

    def _column(self, motion: Motion, time: float) -> ColumnFrame:
        pose = motion.pose(time)
        if motion.deformation_bound(time) < INVISIBLE:
            return ColumnFrame(motion, None, None, pose)
        points = motion.deformed(time)
        if not (np.isfinite(points).all() and np.isfinite(pose).all()):
            raise InputError(f"the prediction at t = {time:.3f} s is not finite; the last good frame stays")
        splats = isinstance(motion.geometry, GaussianSplats)
        return ColumnFrame(motion, points, motion.deformed_covariances(time) if splats else None, pose)

    def largest_deformation(self, wish: Wish) -> float:
        """The time within the trained window at which the first visible column is deformed most."""
        index = wish.visible.index(True)
        window = self.schema.window
        times = np.linspace(window.start, window.stop, 4 * round((window.stop - window.start) * window.rate) + 1)
        return float(times[np.argmax(self.motion(index, wish).deformation_rms(times))])
