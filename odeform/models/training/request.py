"""Describes what a training is asked for, and the command that repeats it."""

import math
from dataclasses import dataclass

from odeform.errors import InputError
from odeform.models.registry import model_class

__all__ = ["TrainRequest"]

OLD_PARTS = {"correction": "residual"}  # as commands that checkpoints record call it


@dataclass(frozen=True)
class TrainRequest:
    """A model and how to train it. `InputError` for a number out of range."""

    model: str = "latent"
    seed: int = 0
    minutes: float = 30.0
    """Budget of processor time, trials included, unless `steps` is given."""
    steps: int | None = None
    """Number of training steps, in place of `minutes`: repeatable on any machine."""
    window: tuple[int, int] | None = None
    """Half-open range of frames to train on; default: all."""
    every: int = 1
    """Train on every n-th frame."""
    stagger: bool = False
    """Start every n-th frame at a different frame in each sequence, so that the sequences interleave."""
    resume: bool = False
    """Continue an interrupted training."""
    sequences: int | None = None
    """Train on the first n training sequences, of each object if there are several; default: all."""
    without: tuple[str, ...] = ()
    """Parts of the model that are left out: names of `Predictor.ablations`."""
    objects: tuple[str, ...] = ()
    """The objects to train on, of a scene with several; default: all."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "without", tuple(OLD_PARTS.get(name, name) for name in self.without))
        if not 0.0 < self.minutes < math.inf:
            raise InputError(f"minutes: expected a positive number, got {self.minutes:g}")
        if self.steps is not None and self.steps < 1:
            raise InputError(f"steps: expected a positive number, got {self.steps}")
        if self.sequences is not None and self.sequences < 1:
            raise InputError(f"sequences: expected a positive number, got {self.sequences}")
        known = model_class(self.model).ablations
        for name in self.without:
            if name not in known:
                raise InputError(f"without {name!r}: {self.model} has {', '.join(known) or 'no such parts'}")

    @property
    def command(self) -> str:
        """The same request as a command line, without the names of files."""
        options = f" --model {self.model} --seed {self.seed}"
        if not model_class(self.model).closed_form:
            options += f" --minutes {self.minutes:g}" if self.steps is None else f" --steps {self.steps}"
        options += f" --window {self.window[0]}:{self.window[1]}" if self.window else ""
        options += f" --every {self.every}" if self.every > 1 else ""
        options += " --stagger" if self.stagger else ""
        options += f" --sequences {self.sequences}" if self.sequences else ""
        options += f" --without {','.join(self.without)}" if self.without else ""
        options += f" --object {' '.join(self.objects)}" if self.objects else ""
        return f"odeform train DIR --out FILE{options}"
