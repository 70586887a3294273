"""Refines the grid of parameters of a figure until what it shows is close to the model."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from odeform.errors import InputError
from odeform.figure.body import FigureBody
from odeform.figure.error import FigureError, Probes, between, draw_probes
from odeform.figure.sampling import Source
from odeform.figure.table import Table, compressed, cubic_weights, product_weights
from odeform.motion.truth_errors import DISTANCE
from odeform.types import Floats, Frames, Times

__all__ = ["BAND_FRACTION", "FigureColumn", "interpolated"]

BAND_FRACTION = 0.2
"""Errors of a figure are at most this fraction of the model's own, if there is room for it: that which half of the
motions stay within, and that which 90 % stay within."""
FIRST = 5  # values of each parameter
MOST_MOTIONS = 9000
UNKNOWN = (
    2e-3,
    6e-3,
)  # of the size of the body, over coordinates: what errors may be where those of the model are not known
RANKS = 64  # patterns that are reckoned with before they are counted
MOST_PATTERNS = 320
LEFT_OUT = 0.3  # of the tolerance, by patterns that are left out
FEWEST = 16  # patterns that a page has to have room for
IN_TIME = 0.5  # of the tolerance, by interpolation between frames
SUBDIVIDED = (1, 2, 4)  # parts of the time between two frames
GAIN = 0.95  # three refinements that leave more of the error than this have come to its end: the solver's own error
MARGIN = 0.95  # of the tolerance, by the grid; the rest is for 16 bits and patterns
SPLATS = 0.65  # of a column that splats may take
EXPANDED = 4.0 / 3.0  # bytes of base64 of each byte

Report = Callable[[int, int, float], None]
"""Called with the motions that are solved, the most there can be, and the RMS distance from the model so far in mm."""


@dataclass(frozen=True, eq=False)
class FigureColumn:
    """One model of a figure."""

    label: str
    source: Source
    body: FigureBody
    table: Table
    times: Times
    """(T,) s, evenly spaced."""
    error: FigureError
    """What is shown against the model, at parameters off the grid and times off the frames."""
    band_mm: tuple[float, float] | None
    """The model's own error over the sliders: RMS distance that half, and 90 %, of unseen motions stay within."""
    tolerance_mm: tuple[float, float]
    """RMS distance that half, and 90 %, of the motions that are shown are to stay within."""

    @property
    def fine(self) -> bool:
        """Whether the error is within the tolerance."""
        return self.error.relative(self.tolerance_mm) <= 1.0

    def points(self, places: Float[np.ndarray, " sweeps"], times: Times) -> Frames:
        """Computes (M, N, 3) metres as the page draws them, at places (A,) on the sliders and times (M,) s."""
        return self.body.points(between(self.table.at(places), self.times, times))


def interpolated(
    label: str, source: Source, times: Times, most_bytes: int, report: Report = lambda *_: None
) -> FigureColumn:
    """Solves motions on a grid that is refined where it helps most, until the error is a fifth of the model's own.

    Args:
        label: Name of the column.
        source: The model and its sliders; with none, a single motion.
        times: (T,) s, evenly spaced, at least four.
        most_bytes: That the column may take in the page.
        report: Told of the progress.

    Raises:
        InputError: Uneven or too few times, a model of points, a shape without faces or one with too many points.
    """
    if len(times) < 4 or not np.allclose(np.diff(times), times[1] - times[0]):
        raise InputError(f"times: expected at least four, evenly spaced, got {len(times)}")
    body = source.body.within(int(SPLATS * most_bytes / EXPANDED))
    probes = draw_probes(source, body, times)
    band = _band(source, probes.places, times)
    size = float(np.ptp(body.rest, axis=0).max())
    own = [1e3 * size * DISTANCE * part / BAND_FRACTION for part in UNKNOWN] if band is None else band
    tolerance = BAND_FRACTION * own[0], BAND_FRACTION * own[1]
    room = most_bytes / EXPANDED - sum(array.nbytes for array in body.arrays().values())
    if room < 2 * FEWEST * len(times) * len(body.scale):
        raise InputError(f"a shape of {len(body.rest)} points does not fit into a figure of {most_bytes / 1e6:.1f} MB")
    longest = int(room / (4 * FEWEST * len(body.scale)))
    fine = _fine_times(source, times, probes, tolerance, longest)
    row = len(fine) * len(body.scale)
    expected = min(max(room / (4 * row), FEWEST), RANKS)
    most = int(min(MOST_MOTIONS, room / (2 * expected) - row))
    grid = _refined(source, fine, probes, tolerance, most, report)
    ranks = int(min(MOST_PATTERNS, (room - 4 * row) / (2 * (row + len(grid.motions)) + 4)))
    table = compressed(grid.motions, grid.counts, body.scale, 1e-3 * LEFT_OUT * tolerance[0] / DISTANCE, ranks)
    error = probes.error(map(table.at, probes.places), fine)
    return FigureColumn(label, source, body, table, fine, error, band, tolerance)


def _fine_times(
    source: Source, times: Times, probes: Probes, tolerance: tuple[float, float], longest: int
) -> Float[np.ndarray, " fine"]:
    """Divides the time between frames until interpolation between them has only a part of the `tolerance`, or there
    would be more than `longest` times."""
    fine = times
    for parts in SUBDIVIDED:
        fine = times[0] + np.arange(parts * (len(times) - 1) + 1) * (times[1] - times[0]) / parts
        error = probes.error(source.coordinates(probes.places, fine), fine)
        if error.relative(tolerance) <= IN_TIME or 2 * len(fine) > longest:
            break
    return fine


def _refined(
    source: Source, times: Times, probes: Probes, tolerance: tuple[float, float], most: int, report: Report
) -> "_Grid":
    """The grid of at most `most` motions with an error within `tolerance`, or else with the smallest error."""
    grid, known = _Grid(source, times), []
    while True:
        error = probes.error(map(grid.at, probes.places), times)
        known.append((error.relative(tolerance), grid.counts))
        report(len(grid.motions), most, error.rms)
        helped = len(known) < 4 or min(known[-3:])[0] < GAIN * min(known[:-3])[0]
        if known[-1][0] <= MARGIN or not helped or not grid.refine(most):
            break
    grid.coarsen(min(known)[1])  # a jump of the motions may happen to lie better between fewer values
    return grid


class _Grid:
    """The motions at each place of a grid."""

    def __init__(self, source: Source, times: Times) -> None:
        self._source, self._times = source, times
        self.counts = (FIRST,) * len(source.sweeps)
        self.motions = source.coordinates(self._places(self.counts), times)

    @staticmethod
    def _places(counts: tuple[int, ...]) -> Floats:
        """(G, A) from 0 to 1."""
        if not counts:
            return np.zeros((1, 0))
        axes = np.meshgrid(*(np.linspace(0.0, 1.0, count) for count in counts), indexing="ij")
        return np.stack([axis.ravel() for axis in axes], axis=1)

    def at(self, place: Float[np.ndarray, " sweeps"]) -> Floats:
        """Interpolates y (T, D) at a place (A,)."""
        if not self.counts:
            return self.motions[0]
        weights = product_weights(place, self.counts)
        near = np.flatnonzero(weights)
        return np.tensordot(weights[near], self.motions[near], axes=1)

    def refine(self, most: int) -> bool:
        """Halve the spacing along the slider along which the grid is coarsest; false if that makes too many motions."""
        finer = [2 * count - 1 for count in self.counts]
        able = [i for i, n in enumerate(finer) if len(self.motions) // self.counts[i] * n <= most]
        if not able:
            return False
        axis = max(able, key=self._coarseness)
        counts = tuple(finer[i] if i == axis else count for i, count in enumerate(self.counts))
        old = self.motions.reshape(*self.counts, *self.motions.shape[1:])
        new = np.empty((*counts, *self.motions.shape[1:]), dtype=np.float32)
        known, missing = [slice(None)] * len(counts), [slice(None)] * len(counts)
        known[axis], missing[axis] = slice(0, None, 2), slice(1, None, 2)
        new[tuple(known)] = old
        places = self._places(counts).reshape(*counts, -1)[tuple(missing)]
        solved = self._source.coordinates(places.reshape(-1, len(counts)), self._times)
        new[tuple(missing)] = solved.reshape(*places.shape[:-1], *solved.shape[1:])
        self.counts, self.motions = counts, new.reshape(-1, *solved.shape[1:])
        return True

    def coarsen(self, counts: tuple[int, ...]) -> None:
        """Go back to the `counts` of an earlier grid."""
        steps = tuple(
            slice(None, None, max((n - 1) // max(m - 1, 1), 1)) for n, m in zip(self.counts, counts, strict=True)
        )
        whole = self.motions.reshape(*self.counts, *self.motions.shape[1:])
        self.counts, self.motions = counts, whole[steps].reshape(-1, *self.motions.shape[1:])

    def _coarseness(self, axis: int) -> float:
        """How much every second value along a slider differs from what the others say."""
        count = self.counts[axis]
        along = np.moveaxis(self.motions.reshape(*self.counts, *self.motions.shape[1:]), axis, 0)
        weights = np.stack([cubic_weights(0.5 * index, count // 2 + 1) for index in range(1, count, 2)])
        scale = self._source.body.scale.astype(np.float32)
        missed = np.tensordot(weights.astype(np.float32), along[::2], axes=1) - along[1::2]
        return float(np.square(missed * scale).mean())


def _band(source: Source, places: Float[np.ndarray, "sets sweeps"], times: Times) -> tuple[float, float] | None:
    """The model's own error, pooled over parameters and times, in mm; None where it is not known."""
    known = source.middle.error_band(times) is not None
    bands = [source.predictor.error_band(source.complete(place), times) for place in places] if known else []
    found = [band for band in bands if band is not None]
    if not found:
        return None
    median, most = DISTANCE * np.sqrt(np.square(found).mean(axis=(0, 1)))  # pooled, as errors are
    return float(median), float(most)
