"""A family of one's own: y'' = f(y, y', theta), a second-order neural ODE of pose and deformation.

odeform train mass-elastic --model second-order --plugin my_family.py --minutes 10 --out mine.safetensors
odeform-viz --checkpoint mass-elastic --compare mine.safetensors --plugin my_family.py
"""

import torch
from torch import nn

import odeform


class SecondOrder(nn.Module):
    """The state is position and velocity of the C coordinates; the readout is the position."""

    def __init__(self, parameters: int, coordinates: int, width: int = 128, rate: float = 10.0) -> None:
        super().__init__()
        self.rate = rate  # 1/s: velocities are of order one
        self.start = nn.Linear(parameters, coordinates)
        self.force = nn.Sequential(
            nn.Linear(2 * coordinates + parameters, width),
            nn.Tanh(),
            nn.Linear(width, width),
            nn.Tanh(),
            nn.Linear(width, coordinates),
        )

    def initial_state(self, theta: torch.Tensor) -> torch.Tensor:
        """(B, P) -> (B, 2 C): at rest in place, with a velocity that the parameters decide."""
        velocity = self.start(theta)
        return torch.cat([torch.zeros_like(velocity), velocity], dim=-1)

    def vector_field(self, t: float, z: torch.Tensor, theta: torch.Tensor) -> torch.Tensor:
        """(B, 2 C) -> its slope per second."""
        velocity = z.chunk(2, dim=-1)[1]
        return self.rate * torch.cat([velocity, self.force(torch.cat([z, theta], dim=-1))], dim=-1)

    def readout(self, t: torch.Tensor, z: torch.Tensor, theta: torch.Tensor) -> torch.Tensor:
        """(B, 2 C) -> (B, C)."""
        return z.chunk(2, dim=-1)[0]


class SecondOrderModel(odeform.NeuralModel):
    """What checkpoints, the command line and the viewer know it by."""

    model = "second-order"
    network = SecondOrder


odeform.register_model("second-order", SecondOrderModel)
