import math

import pytest
import torch

from odeform.solver.adjoint import solve_adjoint, solve_backprop
from odeform.solver.integrate import Quality

Tensors = tuple[torch.Tensor, ...]


def gradients(frames: int, adjoint: bool) -> tuple[torch.Tensor, Tensors]:
    """Gradients of a loss on two moments of t in [0, 1], for a batch, with respect to start and weights."""
    generator = torch.Generator().manual_seed(0)

    def leaf(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=generator, dtype=torch.float64).requires_grad_()

    start, inner, outer, bias = leaf(5, 3), leaf(3, 8), leaf(8, 3), leaf(3)
    unused = leaf(2)

    def field(time: float, state: torch.Tensor) -> torch.Tensor:
        return torch.tanh(state @ inner + math.sin(3.0 * time)) @ outer + bias

    weights, quality = (inner, outer, bias, unused), Quality("rk4", step=1.0 / frames)
    if adjoint:
        states = solve_adjoint(field, start, quality, frames, weights)
    else:
        states = solve_backprop(field, start, quality, frames)
    loss = (states[frames // 2] ** 2).sum() + torch.sin(states[-1]).sum()
    grads = torch.autograd.grad(loss, (start, *weights), allow_unused=True)
    return states.detach(), tuple(torch.zeros(2, dtype=torch.float64) if g is None else g.detach() for g in grads)


def gap(frames: int) -> float:
    """Largest difference of the two gradients, relative to the largest gradient of each input."""
    pairs = list(zip(gradients(frames, True)[1], gradients(frames, False)[1], strict=True))
    return max(float((a - b).abs().max() / b.abs().max().clamp_min(1e-12)) for a, b in pairs)


def test_gradients_agree_as_the_step_shrinks() -> None:
    coarse, fine = gap(16), gap(64)
    assert fine < 1e-6
    assert fine < coarse / 50.0


def test_states_are_the_same() -> None:
    assert torch.equal(gradients(16, True)[0], gradients(16, False)[0])


@pytest.mark.parametrize("adjoint", [True, False])
def test_gradients_of_decay(adjoint: bool) -> None:
    """y = y0 exp(-k t): dy/dy0 = exp(-k t) and dy/dk = -t y."""
    start = torch.tensor([1.3], dtype=torch.float64, requires_grad=True)
    rate = torch.tensor([0.8], dtype=torch.float64, requires_grad=True)
    quality = Quality("rk4", step=0.02)

    def field(_: float, state: torch.Tensor) -> torch.Tensor:
        return -rate * state

    states = (
        solve_adjoint(field, start, quality, 100, (rate,)) if adjoint else solve_backprop(field, start, quality, 100)
    )
    end = states[-1].sum()
    by_start, by_rate = torch.autograd.grad(end, (start, rate))
    assert end.item() == pytest.approx(1.3 * math.exp(-1.6), rel=1e-7)
    assert by_start.item() == pytest.approx(math.exp(-1.6), rel=1e-7)
    assert by_rate.item() == pytest.approx(-2.0 * 1.3 * math.exp(-1.6), rel=1e-7)
