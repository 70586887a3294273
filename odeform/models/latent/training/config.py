"""The settings of a training of ODeform."""

from dataclasses import dataclass

__all__ = ["FREE", "TrainConfig"]

LENGTH = ("minutes", "steps", "report", "refine")
END = ("random_features", "widening", "components", "sharpnesses", "ridges", "between", "deformed")
FREE = (*LENGTH, *END)
"""Settings that may change when a training is resumed: its length, and those of the final solve."""


@dataclass(frozen=True)
class TrainConfig:
    """The settings of a training of ODeform; checkpoints store them under these names."""

    minutes: float = 30.0
    """Budget of processor time, which does not depend on the load of the machine; unless `steps` is given."""
    steps: int | None = None
    """Number of steps, in place of minutes: repeatable."""
    seed: int = 0
    batch: int = 32
    """Sequences per step; more where less than every other frame is observed (see `val.batch` in a checkpoint)."""
    rate: float = 5e-3
    """Initial learning rate; it decays to zero as a cosine."""
    horizon: tuple[float, float] = (0.25, 0.33)
    """Fraction of the motion that is rolled out at first, and fraction of the training in which it grows to the
    whole."""
    ridge: float = 1e-6
    """Ridge of the readout's least squares during descent, relative to the mean square of a feature."""
    random_features: int = 1500
    """Number of random features per decoder, added at the end."""
    sharpnesses: tuple[float, ...] = (0.5, 1.0, 2.0)
    """Candidates for the sharpness of random features; validation chooses for each decoder."""
    ridges: tuple[float, ...] = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13)
    """Candidates for the ridge of the final solve; validation chooses for each decoder."""
    widening: float = 0.33
    """Fraction of the minutes for the final solve; where it does not suffice, there are fewer random features."""
    between: float = 0.1
    """Weight in the final solve, relative to a frame, of the spline through the truth halfway between frames."""
    deformed: float = 4.0
    """Weight in the final solve of the local decoder, of times with more than a tenth of the peak deformation."""
    longest: float = 0.01
    """Longest step in seconds during descent; longer frames are integrated in several steps."""
    refine: int = 2
    """Steps per half frame, relative to those of a frame during descent, where no gradients are needed."""
    without: tuple[str, ...] = ()
    """Parts that are left out (`odeform.models.latent.training.ablation`)."""
    report: float = 60.0
    """Seconds between progress lines, and between saved states."""
