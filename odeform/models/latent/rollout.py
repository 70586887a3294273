"""Roll-outs of tanh networks for training, with a backward pass written out.

RK4 over given steps; two tanh layers and a linear one for each branch. Autograd spends more time on its graph of some
ten thousand small operations than on the arithmetic. Here the activations of all stages are kept in a few arrays, and
the gradient of each weight is one product at the end.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import torch
from torch.autograd.function import once_differentiable

__all__ = ["Branch", "roll_out"]

STAGES = ((1.0 / 6.0, 0.5), (1.0 / 3.0, 0.5), (1.0 / 3.0, 1.0), (1.0 / 6.0, 0.0))
"""Weight of each stage of RK4 in the step, and the fraction of the step to the next stage."""


class Branch(NamedTuple):
    """slope[:, out] = w3 tanh(w2 tanh(w1 state[:, :inputs] + b1) + b2) + b3; b1 (B, width) differs by object."""

    inputs: int
    out: slice
    w1: torch.Tensor
    b1: torch.Tensor
    w2: torch.Tensor
    b2: torch.Tensor
    w3: torch.Tensor
    b3: torch.Tensor

    @property
    def weights(self) -> tuple[torch.Tensor, ...]:
        """(w1, b1, w2, b2, w3, b3)."""
        return self[2:]


class _RollOut(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, steps: Sequence[float], places: list[tuple[int, slice]], start: torch.Tensor, *weights: torch.Tensor
    ) -> torch.Tensor:
        count, batch = len(steps), len(start)
        nets = [weights[at : at + 6] for at in range(0, len(weights), 6)]
        states = start.new_empty(count + 1, *start.shape)
        stages = start.new_empty(count, 4, *start.shape)
        hidden = [[start.new_empty(count, 4, batch, len(net[layer])) for layer in (0, 2)] for net in nets]
        slope = torch.empty_like(start)
        states[0] = start
        for i, step in enumerate(steps):
            carry, after = 0.0, states[i + 1].copy_(states[i])
            for j, (fraction, ahead) in enumerate(STAGES):
                x = torch.add(states[i], slope, alpha=carry, out=stages[i, j]) if j else stages[i, j].copy_(states[i])
                for (inputs, out), (w1, b1, w2, b2, w3, b3), (h1, h2) in zip(places, nets, hidden, strict=True):
                    first = torch.addmm(b1, x[:, :inputs], w1.T, out=h1[i, j]).tanh_()
                    second = torch.addmm(b2, first, w2.T, out=h2[i, j]).tanh_()
                    slope[:, out] = torch.addmm(b3, second, w3.T)
                after.add_(slope, alpha=step * fraction)
                carry = step * ahead
        ctx.steps, ctx.places, ctx.nets, ctx.stages, ctx.hidden = steps, places, nets, stages, hidden
        return states

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *grads: torch.Tensor) -> tuple[Any, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        of_states, places, nets, hidden = grads[0], ctx.places, ctx.nets, ctx.hidden
        errors = [[torch.empty_like(h1), torch.empty_like(h2)] for h1, h2 in hidden]
        # tanh' = 1 - tanh^2
        bends = [[torch.addcmul(h.new_ones(()), h, h, value=-1.0) for h in pair] for pair in hidden]
        of_slopes = torch.empty_like(ctx.stages)
        grad = of_states[-1].clone()
        for i in range(len(ctx.steps) - 1, -1, -1):
            step, total, pulled = ctx.steps[i], grad.clone(), torch.zeros_like(grad)
            for j in (3, 2, 1, 0):
                fraction, ahead = STAGES[j]
                of_slope = torch.mul(grad, step * fraction, out=of_slopes[i, j]).add_(pulled, alpha=step * ahead)
                pulled = torch.zeros_like(grad)
                for (inputs, out), net, (d1, d2), (e1, e2) in zip(places, nets, bends, errors, strict=True):
                    second = torch.mm(of_slope[:, out], net[4], out=e2[i, j]).mul_(d2[i, j])
                    first = torch.mm(second, net[2], out=e1[i, j]).mul_(d1[i, j])
                    pulled[:, :inputs].addmm_(first, net[0])
                total += pulled
            grad = total + of_states[i]
        of_weights = []
        for (inputs, out), (h1, h2), (e1, e2) in zip(places, hidden, errors, strict=True):
            of_out = of_slopes[..., out]
            for error, before in ((e1, ctx.stages[..., :inputs]), (e2, h1), (of_out, h2)):
                of_bias = error.sum(dim=(0, 1)) if error is e1 else error.sum(dim=(0, 1, 2))
                of_weights += [error.flatten(0, 2).T @ before.flatten(0, 2), of_bias]
        return (None, None, grad, *of_weights)


def roll_out(start: torch.Tensor, steps: Sequence[float], branches: Sequence[Branch]) -> torch.Tensor:
    """States (len(steps) + 1, B, S) from `start` (B, S), differentiable in it and in all weights of the branches."""
    places = [(branch.inputs, branch.out) for branch in branches]
    return _RollOut.apply(steps, places, start, *(w for branch in branches for w in branch.weights))  # pyright: ignore
