"""Sizes of the ODeform network."""

import math
from dataclasses import dataclass

from odeform.motion.reduced_space import POSE

__all__ = ["ModelConfig"]


@dataclass(frozen=True)
class ModelConfig:
    """Sizes of the network."""

    parameters: int
    modes: int
    rigid: bool = True
    """Whether the scene has rigid motion; without, there is no rigid branch."""
    rigid_latent: int = 16
    local_latent: int = 48
    point_width: int = 32
    encoder_width: int = 128
    rigid_width: int = 64
    local_width: int = 128
    decoder_widths: tuple[int, ...] = (512,)
    clock: float = 0.1
    """Seconds after which the clock of the decoders, which slows down from -1 towards 1, is halfway."""
    components: int = 16
    """Principal components of a decoder's inputs, on which its random features are built."""
    random_features: int = 0
    """Number per decoder; they are added when the rest is trained."""

    def __post_init__(self) -> None:
        if not (isinstance(self.clock, int | float) and 0.0 < self.clock < math.inf):
            raise ValueError(f"clock: expected a positive number of seconds, got {self.clock!r}")

    @property
    def state(self) -> int:
        """Size of the ODE's state: the latent states of all branches."""
        return self.rigid_latent * self.rigid + self.local_latent

    @property
    def branches(self) -> tuple[str, ...]:
        """Names of the branches, in the order of the latent state."""
        return ("rigid", "local") if self.rigid else ("local",)

    @property
    def states(self) -> list[slice]:
        """The part of the latent state that belongs to each branch."""
        split = self.rigid_latent
        return [slice(0, split), slice(split, None)] if self.rigid else [slice(0, None)]

    def latent(self, branch: str) -> int:
        """Returns the size of the latent state of a branch."""
        return self.rigid_latent if branch == "rigid" else self.local_latent

    def sizes(self, branch: str) -> dict[str, list[int]]:
        """Layer widths of each part of a branch, inputs first. Decoders are conditioned on a clock as well."""
        rigid = branch == "rigid"
        latent, outputs = self.latent(branch), POSE if rigid else self.modes
        inputs = (self.rigid_latent if rigid else self.state) + self.parameters
        width = self.rigid_width if rigid else self.local_width
        conditions = 1 + self.parameters
        return {
            "encoder.points": [3, self.point_width, self.point_width],
            "encoder.head": [self.point_width + self.parameters, self.encoder_width, self.encoder_width, latent],
            "field": [inputs, width, width, latent],
            "decoder.hidden": [latent + conditions, *self.decoder_widths],
            "decoder.random": [
                latent + self.decoder_widths[-1] + conditions,
                self.components + conditions,
                self.random_features,
            ],
            "decoder.readout": [latent + self.decoder_widths[-1] + self.random_features, outputs],
        }
