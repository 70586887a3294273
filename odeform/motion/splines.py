"""Interpolation between frames."""

from odeform.types import Floats

__all__ = ["catmull_rom"]


def catmull_rom(before: Floats, here: Floats, there: Floats, after: Floats, fraction: Floats) -> Floats:
    """Between the frames `here` (fraction 0) and `there` (fraction 1), whose neighbours are `before` and `after`.

    Frames have any one shape (...), and `fraction` in [0, 1] broadcasts to it. A cubic with central differences for
    slopes (Catmull & Rom 1974): exact for quadratics, and on frames.
    """
    straight, left, right = there - here, 0.5 * (there - before), 0.5 * (after - here)
    bend = (1.0 - fraction) * (left - straight) - fraction * (right - straight)
    return here + fraction * straight + fraction * (1.0 - fraction) * bend
