"""Whether numbers of frames are evenly spaced, and which ones are missing."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from odeform.errors import InputError
from odeform.types import Floats

__all__ = ["even_step", "short"]

COARSE = 0.2  # of a step: numbers that are rounded by more say nothing of it
UNEVEN = 1e-3  # of a step: numbers that differ by less are evenly spaced


def even_step(
    numbers: Floats,
    where: str,
    names: Sequence[str],
    decimal: bool,
    rounding: float = 0.0,
    first: float = 0.0,
    hint: str = "",
) -> float | None:
    """The step between numbers that increase; None for one number, and for uneven decimals without an evident gap.

    Args:
        numbers: (T,) from the first of them on.
        where: What leads messages.
        names: (T) of the frames.
        decimal: Whether they are decimals, which may be times.
        rounding: They may be rounded to multiples of it.
        first: What is added to numbers in messages.
        hint: What ends messages.

    Raises:
        InputError: Numbers are missing, or are integers without a common step.
    """
    steps = np.diff(numbers)
    if not len(steps):
        return None
    often = Counter(float(f"{step:.9g}") for step in steps).most_common(1)[0]
    likely = often[0] if often[1] > 1 else float(steps.min())
    for step, error in ((likely, 0.0), (float(np.median(steps)), 0.5 * rounding)):
        fitted = _on_a_grid(numbers, step, error)
        if fitted is None:
            continue
        step, skipped = fitted
        if not skipped.any():
            return step
        if not decimal or 2 * np.count_nonzero(skipped) <= len(steps):
            index = int(np.argmax(skipped > 0))
            ends = first + numbers[index] + step, first + numbers[index + 1] - step
            lowest, highest = (0.0 if abs(end) < UNEVEN * step else end for end in ends)  # a sum of decimals is rounded
            frames = f"frames {short(lowest)} to {short(highest)} are"
            missing = f"frame {short(lowest)} is" if skipped[index] == 1 else frames
            between = f"between {names[index]} and {names[index + 1]}"
            raise InputError(f"{where}: {missing} missing {between}{hint}")
    if decimal:
        return None
    index = int(np.argmax(steps != likely))
    raise InputError(
        f"{where}: expected frames numbered in equal steps, got {names[index]} and {names[index + 1]}, "
        f"{short(steps[index])} apart, among steps of {short(likely)}{hint}"
    )


def _on_a_grid(values: Floats, step: float, error: float) -> tuple[float, Floats] | None:
    """The step of (T,) values that are multiples of it from the first, and how many multiples each step leaves out.

    None for values that are off by more than a small part of the step and `error`, or if that is no small part.
    """
    if error > COARSE * step:
        return None
    widths = np.maximum(np.round(np.diff(values) / step), 1.0)
    places = np.concatenate([[0.0], np.cumsum(widths)])
    fitted = float((values[-1] - values[0]) / places[-1])
    off = np.abs(values - values[0] - fitted * places).max()
    return None if off > 2.0 * error + UNEVEN * fitted else (fitted, widths - 1.0)


def short(number: float) -> str:
    """Returns a number for a message, with all digits of integers."""
    return f"{number:.6g}" if abs(number) < 1e5 else f"{float(number):.17g}"
