"""How to train."""

from dataclasses import dataclass

__all__ = ["FREE", "TrainConfig"]

LENGTH = ("minutes", "steps", "report", "refine")
END = ("random_features", "widening", "components", "sharpnesses", "ridges", "between", "deformed")
FREE = (*LENGTH, *END)
"""Settings that may change when a training is resumed: of its length, and of what is solved for at its end."""


@dataclass(frozen=True)
class TrainConfig:
    """How to train."""

    minutes: float = 30.0
    """Of processor time, which a busy machine does not stretch, unless `steps` are given."""
    steps: int | None = None
    """So many steps, however long they take: the same result on a busy machine."""
    seed: int = 0
    batch: int = 32
    """Sequences in a step; more, where they show less than every other frame."""
    rate: float = 5e-3
    """Learning rate at the start; falls by a cosine to nothing."""
    horizon: tuple[float, float] = (0.25, 0.33)
    """Share of the motion that is rolled out at first, and share of the time in which it grows to the whole."""
    ridge: float = 1e-6
    """Of the readout's least squares, relative to the mean square of a feature."""
    random_features: int = 1500
    """Of each decoder, added at the end."""
    sharpnesses: tuple[float, ...] = (0.5, 1.0, 2.0)
    """Of random features: among these and `ridges`, validation chooses for each decoder."""
    ridges: tuple[float, ...] = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13)
    """Of the last solve."""
    widening: float = 0.33
    """Share of the minutes that goes to the random features; where it does not suffice, there are fewer."""
    between: float = 0.1
    """Weight in the last solve, relative to that of a frame, of the spline through the truth halfway between frames."""
    deformed: float = 4.0
    """Weight in it of moments at which a body is deformed by more than a tenth of its peak, for the local decoder."""
    longest: float = 0.01
    """Seconds; longer frames are integrated in several steps while descending."""
    refine: int = 2
    """As many times more steps, in half the time, where no gradients are wanted: they leave no error of their own."""
    report: float = 60.0
    """Seconds between lines of progress, and between saved states."""
