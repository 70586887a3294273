import numpy as np
import pytest
import torch

from odeform.dataset.index import Dataset
from odeform.dataset.training_data import TrainingData, prepare
from odeform.geometry.rigid import rotation_from_vector
from odeform.models.latent.training.losses import Metric, balanced
from odeform.motion.reduced_space import POSE


@pytest.fixture(scope="module")
def data(dataset: Dataset) -> TrainingData:
    return prepare(dataset, modes=8)


@pytest.mark.parametrize("part", ["shift", "turn", "deformation"])
def test_reads_in_millimetres_of_the_vertices(data: TrainingData, part: str) -> None:
    """Small random errors, measured on the vertices themselves."""
    where = {"shift": slice(0, 3), "turn": slice(3, POSE), "deformation": slice(POSE, None)}[part]
    truth = torch.zeros(40, POSE + 8, dtype=torch.float64)
    error = truth.clone()
    error[:, where] = 1e-3 * torch.randn(error[:, where].shape, generator=torch.Generator().manual_seed(0)).double()
    gains = torch.linspace(0.5, 2.0, POSE + 8, dtype=torch.float64)
    losses = Metric(gains, data.space.gyration_radius)(error / gains, truth, torch.ones(40).double())

    y = error.numpy()
    local = data.rest + np.einsum("nik,tk->tni", data.space.basis.values(data.rest), y[:, POSE:])
    moved = local @ rotation_from_vector(y[:, 3:POSE]).swapaxes(1, 2) + y[:, None, :3]
    squared = 1e6 * np.einsum("n,tni->t", data.weights, (moved - data.rest) ** 2).mean()
    assert float(sum(losses)) == pytest.approx(squared, rel=0.02)
    assert float(losses[0 if part == "deformation" else 1]) == 0.0


def test_losses_pull_by_their_relative_error() -> None:
    """Six orders of magnitude apart: d total / d ln L_i is one for both."""
    losses = [torch.tensor(x, dtype=torch.float64, requires_grad=True) for x in (1e4, 1e-2)]
    pulls = torch.autograd.grad(balanced(*losses), losses)
    assert [(pull * loss).item() for pull, loss in zip(pulls, losses, strict=True)] == pytest.approx([1.0, 1.0])


def test_a_loss_of_nothing_is_finite() -> None:
    zero = torch.tensor(0.0, requires_grad=True)
    balanced(zero).backward()
    assert zero.grad is not None
    assert torch.isfinite(zero.grad)
