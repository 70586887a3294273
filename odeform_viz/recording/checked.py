"""The comparison of one recorded column with what is computed now."""

from dataclasses import dataclass

import numpy as np

from odeform.types import Points

__all__ = ["CheckedColumn"]


@dataclass(eq=False)
class CheckedColumn:
    """How far one column of a recording is from what is computed now."""

    label: str
    frames: int = 0
    """Frames that were compared."""
    error: float = 0.0
    """The largest distance of a point, in m; it occurs at `vertex` in `frame`, at `time` in s."""
    frame: int = 0
    time: float = 0.0
    vertex: int = 0
    missing: int = 0
    """Frames that show the column, but whose points are not in the file."""
    skipped: str = ""
    """Why the column cannot be computed again."""
    note: str = ""
    """Says what has to be known of it: that its shape was not trained."""
    problem: str = ""
    """Why it differs from the recording, regardless of its frames."""

    def compare(self, frame: int, time: float, recorded: Points, computed: Points) -> None:
        """Compare points (N, 3) in m of one frame, at `time` in s."""
        self.frames += 1
        if recorded.shape != computed.shape:
            self.problem = f"{len(recorded)} points were recorded, {len(computed)} are computed now"
            return
        distances = np.nan_to_num(np.linalg.norm(recorded - computed, axis=1), nan=np.inf)
        worst = int(distances.argmax())
        if self.frames == 1 or distances[worst] > self.error:
            self.error, self.frame, self.time, self.vertex = float(distances[worst]), frame, time, worst

    def agrees(self, tolerance: float, closed: bool) -> bool:
        """Whether all points agree within `tolerance` m. The last frames of a recording not `closed` may be missing."""
        lacks = self.missing and (closed or not self.frames)
        return not self.problem and self.error <= tolerance and not lacks

    def describe(self) -> str:
        """Returns the result in one line."""
        if self.skipped or (self.problem and not self.frames):
            return f"{self.label}: {self.problem or f'skipped, {self.skipped}'}"
        text = f"{self.label}: {self.frames} frames"
        if self.frames:
            where = f"frame {self.frame}, t = {self.time:.4f} s, vertex {self.vertex}"
            text += f", at most {self.error:.2g} m off ({where})"
        if self.missing:
            text += f"; the points of {self.missing} more are missing"
        return "; ".join(part for part in (text, self.note, self.problem) if part)
