"""Losses in millimetres, and their balance."""

import torch
from torch import nn

from odeform.motion.reduced_space import POSE

__all__ = ["Metric", "balanced"]


class Metric(nn.Module):
    """Squared errors of whitened reduced coordinates, in mm^2 of RMS displacement of the body.

    With orthonormal modes the sum over coefficients is exactly the mean over the points. A small rotation |w| moves a
    round body with radius of gyration r by sqrt(2/3) r |w|, in RMS over axes.
    """

    scale: torch.Tensor

    def __init__(self, output_scales: torch.Tensor, gyration_radius: float) -> None:
        super().__init__()
        scale = 1e3 * output_scales.clone()
        scale[3:POSE] *= gyration_radius * (2.0 / 3.0) ** 0.5
        self.register_buffer("scale", scale)

    def forward(
        self, predicted: torch.Tensor, truth: torch.Tensor, weights: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """(..., 6 + K) whitened, weights (...) -> L_rigid and L_points, mean mm^2 per frame."""
        squared = ((predicted - truth) * self.scale) ** 2
        rigid, local = (part.sum(dim=-1) for part in squared.tensor_split((POSE,), dim=-1))
        return (weights * rigid).sum() / weights.sum(), (weights * local).sum() / weights.sum()


def balanced(*losses: torch.Tensor) -> torch.Tensor:
    """A loss with the gradient of sum_i ln L_i; its value is the number of losses.

    This is the paper's automatic weighting (eq. 10) with each s_i^2 at its optimum for large losses, L_i / 2. Rigid and
    local errors differ by orders of magnitude in mm^2; this way each counts by its relative error.
    """
    return torch.stack([loss / loss.detach().clamp_min(1e-30) for loss in losses]).sum()
