"""Sizes of the ODeform network."""

from dataclasses import dataclass

__all__ = ["ModelConfig"]


@dataclass(frozen=True)
class ModelConfig:
    """Sizes of the network."""

    parameters: int
    modes: int
    rigid: bool = True
    """Whether the scene has rigid motion; without, there is no rigid branch."""
    rigid_latent: int = 32
    local_latent: int = 128
    point_width: int = 32
    encoder_width: int = 128
    rigid_width: int = 128
    local_width: int = 256
    decoder_width: int = 128

    @property
    def state(self) -> int:
        return self.rigid_latent * self.rigid + self.local_latent
