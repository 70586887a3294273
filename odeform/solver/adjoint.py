"""Gradients through an integration in constant memory: the adjoint method (Chen et al. 2018, paper III-D)."""

from collections.abc import Callable
from typing import Any

import torch

from odeform.solver.integrate import Quality, integrate

__all__ = ["solve_adjoint", "solve_backprop"]


def solve_backprop(
    field: Callable[[float, torch.Tensor], torch.Tensor], start: torch.Tensor, quality: Quality, frames: int
) -> torch.Tensor:
    """(frames + 1, ...) states at the first `frames` nodes of fixed steps, differentiable through every stage."""
    assert quality.step is not None
    solution = integrate(field, start, quality, until=frames * quality.step)
    return torch.stack(solution.states[: frames + 1])


class _Adjoint(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, field: Callable[..., torch.Tensor], quality: Quality, frames: int, start: torch.Tensor, *weights: Any
    ) -> torch.Tensor:
        with torch.no_grad():
            states = solve_backprop(field, start, quality, frames)
        ctx.field, ctx.quality, ctx.weights = field, quality, weights
        ctx.save_for_backward(states)
        return states

    @staticmethod
    def backward(ctx: Any, *grads: torch.Tensor) -> tuple[Any, ...]:
        (states,) = ctx.saved_tensors
        grad, weights, step = grads[0], ctx.weights, ctx.quality.step
        size, shape = states[0].numel(), states[0].shape

        def backward_field(time: float, joint: torch.Tensor) -> torch.Tensor:
            # integrates in s = -t: d(state, adjoint, weight gradients)/ds
            state = joint[:size].reshape(shape).detach().requires_grad_(True)
            adjoint = joint[size : 2 * size].reshape(shape)
            with torch.enable_grad():
                slope = ctx.field(-time, state)
                pulled = torch.autograd.grad(slope, (state, *weights), adjoint, allow_unused=True)
            flat = [
                (torch.zeros_like(x) if g is None else g).reshape(-1)
                for g, x in zip(pulled, (state, *weights), strict=True)
            ]
            return torch.cat([-slope.detach().reshape(-1), *flat])

        adjoint = grad[-1].clone()
        totals = torch.zeros(sum(w.numel() for w in weights), dtype=states.dtype, device=states.device)
        for index in range(len(states) - 1, 0, -1):
            # each interval restarts from the stored state, so that the backward error does not build up
            joint = torch.cat([states[index].reshape(-1), adjoint.reshape(-1), totals])
            end = integrate(backward_field, joint, ctx.quality, until=-(index - 1) * step, begin=-index * step)
            joint = end.states[1]
            adjoint = joint[size : 2 * size].reshape(shape) + grad[index - 1]
            totals = joint[2 * size :]
        pieces = [p.reshape(w.shape) for p, w in zip(totals.split([w.numel() for w in weights]), weights, strict=True)]
        return (None, None, None, adjoint, *pieces)


def solve_adjoint(
    field: Callable[[float, torch.Tensor], torch.Tensor],
    start: torch.Tensor,
    quality: Quality,
    frames: int,
    weights: tuple[torch.Tensor, ...],
) -> torch.Tensor:
    """As `solve_backprop`, with memory that does not grow with the stages.

    `weights` are all tensors that `field` depends on besides the state and that want gradients; one left out
    silently gets none, hence they are not optional.
    """
    return _Adjoint.apply(field, quality, frames, start, *weights)  # pyright: ignore[reportReturnType]
