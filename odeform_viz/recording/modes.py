"""Deformed shapes as sums of modes: a frame of a motion then takes some numbers instead of all its points.

The modes are the motion's own. Each is what the ones before cannot express of a frame; most motions soon need no more.
"""

import numpy as np

from odeform.types import Floats, Points

__all__ = ["EXACT", "ModeEncoder", "decode"]

EXACT = 2e-7  # m; a tenth of what float32 positions and poses differ by when a frame is computed again
MOST_BYTES = 64 << 20  # of the modes of one shape
MOST = 256  # modes; more take longer than logging the points


class ModeEncoder:
    """Writes points as `rest` plus a sum of modes, to within `EXACT` in each coordinate, and adds modes as needed."""

    def __init__(self, rest: Points) -> None:
        """`rest` (N, 3) in m."""
        self._rest = np.asarray(rest, dtype=np.float32)
        self._most = max(min(MOST, MOST_BYTES // max(self._rest.nbytes, 1)), 1)
        self._modes = np.zeros((0, self._rest.size), dtype=np.float32)

    def encode(self, points: Points) -> tuple[Floats, Points | None] | None:
        """Coefficients (M,) in m of the modes so far, and a mode (N, 3) if one was added, which is then the last.

        None for points that the modes cannot express: not finite ones, or any others once there are `MOST` modes.
        """
        rest = np.asarray(points, dtype=np.float32).ravel() - self._rest.ravel()
        if not np.isfinite(rest).all():
            return None
        coefficients = np.zeros(len(self._modes))
        for _ in range(2):  # the second pass removes the rounding of the first
            part = self._modes @ rest
            coefficients += part
            rest = rest - part @ self._modes
        if np.abs(rest).max(initial=0.0) <= EXACT:
            return coefficients, None
        if len(self._modes) == self._most:
            return None
        length = float(np.linalg.norm(rest))
        mode = (rest / length).astype(np.float32)
        self._modes = np.concatenate([self._modes, mode[None]])
        return np.append(coefficients, length), mode.reshape(-1, 3)


def decode(rest: Points, modes: Floats, coefficients: Floats) -> Points:
    """The points (N, 3) in m that `coefficients` (M,) stand for, of at least as many `modes` (..., N, 3)."""
    used = np.asarray(modes[: len(coefficients)], dtype=float)
    return np.asarray(rest, dtype=float) + np.einsum("m,mni->ni", coefficients, used)
