"""Losses in millimetres, and their automatic weighting."""

import torch
from torch import nn

from odeform.model.reduced import POSE

__all__ = ["AutomaticWeights", "Metric"]


class Metric(nn.Module):
    """Squared errors of whitened reduced coordinates, in mm^2 of RMS displacement of the body.

    Orthonormal modes make the sum over coefficients the mean over the points, exactly; a small turn |w| moves a round
    body of radius of gyration r by sqrt(2/3) r |w| in RMS over axes.
    """

    scale: torch.Tensor

    def __init__(self, gains: torch.Tensor, arm: float) -> None:
        super().__init__()
        scale = 1e3 * gains.clone()
        scale[3:POSE] *= arm * (2.0 / 3.0) ** 0.5
        self.register_buffer("scale", scale)

    def forward(
        self, predicted: torch.Tensor, truth: torch.Tensor, emphasis: torch.Tensor | None = None, change: float = 0.0
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """(..., T, 6 + K) whitened -> L_rigid and L_points, mean mm^2 a frame.

        `emphasis` (T,) weights the frames. `change` adds the squared errors of the steps from frame to frame, as if
        each went on for so many frames: motion that is right on average but trembles or jumps is not right.
        """
        error = (predicted - truth) * self.scale
        squared = error**2
        if change:
            steps = change**2 * (error[..., 1:, :] - error[..., :-1, :]) ** 2
            squared = squared + torch.cat([torch.zeros_like(steps[..., :1, :]), steps], dim=-2)
        if emphasis is not None:
            squared = squared * emphasis[:, None]
        return squared[..., :POSE].sum(dim=-1).mean(), squared[..., POSE:].sum(dim=-1).mean()


class AutomaticWeights(nn.Module):
    """L = sum_i L_i / (2 s_i^2) + ln(1 + s_i^2), learned s_i (Liebel & Koerner 2018; paper eq. 10).

    The s_i start at what the first losses ask for: rigid and local errors differ by six orders of magnitude in mm^2,
    and from a common start the smaller one would not be learned for thousands of steps.
    """

    RATE = 20.0
    """Learning rate of the s_i relative to the network's: they have to follow losses that fall by orders."""

    def __init__(self, terms: int) -> None:
        super().__init__()
        self.log_scale = nn.Parameter(torch.zeros(terms))
        self._started = False

    def forward(self, *losses: torch.Tensor) -> torch.Tensor:
        stacked = torch.stack(losses)
        if not self._started:
            self._started = True
            self.log_scale.data = 0.5 * torch.log(0.5 * stacked.detach() + 1e-6)
        squared = torch.exp(2.0 * self.log_scale)
        return (stacked / (2.0 * squared) + torch.log1p(squared)).sum()
