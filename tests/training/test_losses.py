import numpy as np
import pytest
import torch

from odeform.dataset.index import Dataset
from odeform.geometry.rigid import rotation_from_vector
from odeform.model.data import TrainingData, prepare
from odeform.model.reduced import POSE
from odeform.training.losses import AutomaticWeights, Metric


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
    losses = Metric(gains, data.space.arm)(error / gains, truth)

    y = error.numpy()
    local = data.rest + np.einsum("nik,tk->tni", data.space.basis.values(data.rest), y[:, POSE:])
    moved = local @ rotation_from_vector(y[:, 3:POSE]).swapaxes(1, 2) + y[:, None, :3]
    squared = 1e6 * np.einsum("n,tni->t", data.weights, (moved - data.rest) ** 2).mean()
    assert float(sum(losses)) == pytest.approx(squared, rel=0.02)
    assert float(losses[0 if part == "deformation" else 1]) == 0.0


def test_trembling_costs_more_than_an_offset() -> None:
    metric = Metric(torch.ones(POSE + 2), 0.1)
    truth = torch.zeros(11, POSE + 2)
    offset, trembling = truth + 1e-3, truth + 1e-3
    trembling[1::2] *= -1.0
    plain = [metric(error, truth)[0].item() for error in (offset, trembling)]
    assert plain[0] == pytest.approx(plain[1])
    with_change = [metric(error, truth, change=2.0)[0].item() for error in (offset, trembling)]
    assert with_change[0] == pytest.approx(plain[0])
    # ten of eleven frames differ from the one before by twice the offset
    assert with_change[1] == pytest.approx(plain[0] * (1.0 + 4.0 * 4.0 * 10.0 / 11.0), rel=1e-4)


def test_emphasis_weights_the_frames() -> None:
    metric = Metric(torch.ones(POSE + 2), 0.1)
    truth, error = torch.zeros(3, POSE + 2), torch.zeros(3, POSE + 2)
    error[1, 0], error[2, 0] = 1e-3, 2e-3
    rigid, points = metric(error, truth, emphasis=torch.tensor([9.0, 2.0, 0.5]))
    assert rigid.item() == pytest.approx((2.0 * 1.0 + 0.5 * 4.0) / 3.0, rel=1e-5)
    assert points.item() == 0.0


def test_automatic_weights_start_balanced() -> None:
    """Six orders of magnitude apart, both losses pull equally at first: d total / d log L_i is the same."""
    losses = [torch.tensor(x, dtype=torch.float64, requires_grad=True) for x in (1e4, 1e-2)]
    pulls = torch.autograd.grad(AutomaticWeights(2).double()(*losses), losses)
    relative = [(pull * loss).item() for pull, loss in zip(pulls, losses, strict=True)]
    assert relative[0] == pytest.approx(relative[1], rel=1e-3)


def test_automatic_weights_follow_their_losses() -> None:
    balance = AutomaticWeights(2)
    first = balance(torch.tensor(100.0), torch.tensor(1.0))
    later = balance(torch.tensor(1.0), torch.tensor(1.0))
    assert later < first
    later.backward()
    grad = balance.log_scale.grad
    assert grad is not None
    # the scale of a loss that has fallen wants to fall after it
    assert grad[0] > 0.5
