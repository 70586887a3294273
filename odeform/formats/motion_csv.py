"""Curves of a motion over time as a table, in SI units of the scene."""

import csv
import io
from typing import IO

import numpy as np

from odeform.geometry.rigid import unwrapped_vectors
from odeform.geometry.shape import FittedShape
from odeform.motion.base import LATEST, Motion
from odeform.motion.caveats import caveats
from odeform.motion.recorded import RecordedMotion
from odeform.motion.truth_errors import truth_errors
from odeform.types import Floats, Times

__all__ = ["COLUMNS", "ERRORS", "write_csv"]

COLUMNS = (
    "time_s",
    "center_x_m",
    "center_y_m",
    "center_z_m",
    "rotation_deg",
    "deformation_rms_mm",
    "expected_error_median_mm",
    "expected_error_90_mm",
    "status",
    "notes",
)
ERRORS = ("error_rmse_mm", "error_mae_mm", "error_worst_mm")


def write_csv(
    file: IO[bytes], motion: Motion, times: Times, fit: FittedShape | None, truth: RecordedMotion | None = None
) -> None:
    """Writes one row for each of `times` (T,) s, below a row with the names in `COLUMNS`.

    The centre is the mean of the points, moved with the body. The rotation is the angle from the shape at rest, and
    grows past whole turns. Errors are RMSE (`Motion.error_band`), empty where they are not known. `status` is "ok", or
    names what is wrong at that time: `untrained-shape`, `outside-parameters`, `outside-window`, `stopped`, `unsolved`.
    `notes` says it in words (`odeform.motion.caveats`). Lengths are those of the scene, also with `fit`. With a `truth`
    the columns `ERRORS` follow (`odeform.motion.truth_errors`), empty after its end.
    """
    poses = motion.pose(times)
    centre = np.asarray(motion.geometry.points, dtype=float).mean(axis=0)
    centres = poses[:, :3, :3] @ centre + poses[:, :3, 3]
    band = motion.error_band(times)
    errors = [("", "")] * len(times) if band is None else [tuple(map(_number, row)) for row in band]
    curves = np.column_stack([times, centres, _rotation(motion, times), 1e3 * motion.deformation_rms(times)])
    off = [[]] * len(times) if truth is None else truth_errors(motion, truth, times)
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS if truth is None else COLUMNS + ERRORS)
    for row, error, measured in zip(curves, errors, off, strict=True):
        notes = "; ".join(caveats(motion, row[:1]))
        table.writerow(
            [
                *map(_number, row),
                *error,
                _status(motion, float(row[0])),
                notes,
                *("" if np.isnan(x) else _number(x) for x in measured),
            ]
        )
    file.write(text.getvalue().encode())


def _rotation(motion: Motion, times: Times) -> Floats:
    """(T,) degrees. Turns are counted over trained frames too: `times` may be too far apart for it."""
    window = motion.schema.window
    end = min(float(np.max(times)), LATEST * window.stop)
    every, index = np.unique(np.concatenate([np.arange(0.0, end, 1.0 / window.rate), times]), return_inverse=True)
    angles = np.linalg.norm(unwrapped_vectors(motion.pose(every)[:, :3, :3]), axis=1)
    return np.degrees(angles)[index[len(index) - len(times) :]]


def _status(motion: Motion, time: float) -> str:
    stop = motion.stop_at(time)
    flags = {
        "untrained-shape": motion.untrained,
        "outside-parameters": bool(motion.outside),
        "outside-window": motion.extrapolates(time),
        "stopped": stop is not None and not stop.limited,
        "limited": stop is not None and stop.limited,
        "unsolved": time > motion.last_good,
    }
    return " ".join(name for name, holds in flags.items() if holds) or "ok"


def _number(value: float) -> str:
    return f"{value:.9g}"
