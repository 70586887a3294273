"""The titles of columns in the scene."""

from odeform_viz.view import ColumnFrame

__all__ = ["title_of"]

LETTER = 6.6  # px; mean width of a letter in viser's labels


def title_of(shown: ColumnFrame, pixels: float) -> str:
    """Two lines that fit into `pixels`: the name of the column; its error and a warning, if any."""
    most = max(int(pixels / LETTER), 4)
    below = [f"RMS {shown.error.rms_mm:.2f} mm"] if shown.error else []
    below += ["shape not trained"] if shown.untrained else []
    below += ["below the floor"] if shown.below_floor else []
    return "\n".join(_shortened(line, most) for line in (shown.column.label, " · ".join(below)) if line)


def _shortened(text: str, most: int) -> str:
    """A text of at most `most` letters; of a longer one the middle is left out, since names differ at their ends."""
    if len(text) <= most:
        return text
    tail = (most - 1) // 2
    return f"{text[: most - 1 - tail]}…{text[len(text) - tail :]}"
