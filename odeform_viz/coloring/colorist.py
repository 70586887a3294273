"""Computes what the colors of a frame show: displacement, strain, or the distance from the truth."""

from collections.abc import Mapping, Sequence

import numpy as np

from odeform.motion.recorded import RecordedMotion
from odeform.types import Geometry, Mesh, Perpoint
from odeform_viz.coloring.interpolation import NearestInterpolation
from odeform_viz.coloring.scale import ScaleFitter
from odeform_viz.coloring.strain import SurfaceStrain
from odeform_viz.view import Coloring, ColumnFrame, Frame

__all__ = ["Colorist"]

FAR = 5.0  # times the largest values of the middle column, beyond which a column ends no scale
USED = 0.99  # quantile of the values that the scale reaches: single vertices do not set it


class Colorist:
    """Computes the values, and fits one scale to all visible columns.

    It keeps what depends on shapes alone, as long as frames have these columns and this truth.
    """

    def __init__(self) -> None:
        self._fitter = ScaleFitter()
        self._strains: dict[int, tuple[Geometry, SurfaceStrain]] = {}
        self._carried: dict[int, tuple[RecordedMotion, Geometry, NearestInterpolation]] = {}

    def color(self, frame: Frame, quantity: str, momentary: bool = True) -> Coloring | None:
        """The values of each column; None where no visible column has any, as for errors without a truth.

        Unless `momentary`, they are on the scale that `fit` has found, once it has.
        """
        self._forget(frame)
        values = self._all_values(frame, quantity)
        if not values:
            return None
        fixed = None if momentary else self._fitter.fixed(quantity)
        return Coloring(fixed or self._fitter.fit(quantity, _largest(values)), values)

    def fit(self, frames: Sequence[Frame], quantity: str) -> None:
        """Fit the scale to a motion, given by the moments of its largest values."""
        found = [values for frame in frames if (values := self._all_values(frame, quantity))]
        if found:
            self._fitter.fit(quantity, max(map(_largest, found)), momentary=False)

    def _forget(self, frame: Frame) -> None:
        """Forget what belongs to columns or a truth that a frame does not have: whole sequences would be kept."""
        keys, truth = {column.key for column in frame.request.columns}, frame.truth.motion if frame.truth else None
        self._strains = {key: known for key, known in self._strains.items() if key in keys}
        self._carried = {key: known for key, known in self._carried.items() if key in keys and known[0] is truth}

    def _all_values(self, frame: Frame, quantity: str) -> dict[int, Perpoint]:
        found = ((c.column.key, self._values(c, frame, quantity)) for c in frame.columns)
        return {key: values for key, values in found if values is not None}

    def _values(self, shown: ColumnFrame, frame: Frame, quantity: str) -> Perpoint | None:
        rest = shown.column.geometry
        if quantity == "displacement":
            if shown.points is None:
                return np.zeros(len(rest.points))
            return 1e3 * np.linalg.norm(np.subtract(shown.points, rest.points, dtype=float), axis=1)
        if quantity == "strain" and isinstance(rest, Mesh):
            return 100.0 * self._strain(shown, rest)
        if quantity == "error" and shown.error is not None and frame.truth is not None:
            return self._on_column(shown, frame.truth, 1e3 * shown.error.distances)
        return None

    def _strain(self, shown: ColumnFrame, rest: Mesh) -> Perpoint:
        if shown.points is None:
            return np.zeros(len(rest.points))
        known = self._strains.get(shown.column.key)
        if known is None or known[0] is not rest:
            known = self._strains[shown.column.key] = (rest, SurfaceStrain(rest))
        return known[1](shown.points)

    def _on_column(self, shown: ColumnFrame, truth: ColumnFrame, values: Perpoint) -> Perpoint:
        """Values at the truth's vertices, carried to the points of the column."""
        record, rest = truth.motion, shown.column.geometry
        assert isinstance(record, RecordedMotion)
        known = self._carried.get(shown.column.key)
        if known is None or known[0] is not record or known[1] is not rest:
            carried = NearestInterpolation(record.geometry.points, rest.points)
            known = self._carried[shown.column.key] = (record, rest, carried)
        return known[2](values)


def _largest(values: Mapping[int, Perpoint]) -> float:
    """Where the scale ends: at the largest values, without columns so far off that no other had colours."""
    tops = sorted(float(np.quantile(found, USED)) for found in values.values())
    usual = FAR * tops[(len(tops) - 1) // 2]
    return max(top for top in tops if top <= usual or top == tops[0])
