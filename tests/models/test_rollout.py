"""The hand-written backward pass against autograd, in double precision."""

import pytest
import torch

from odeform.models.latent.rollout import Branch, roll_out

STEPS = [0.1, 0.3, 0.05]


def branches(seed: int, batch: int = 5, rigid: int = 4, state: int = 11) -> list[Branch]:
    """Two fields as ODeform has them: the first sees its own part alone, the second the whole state."""
    generator = torch.Generator().manual_seed(seed)

    def weight(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=generator, dtype=torch.float64).mul(0.5).requires_grad_()

    def branch(inputs: int, out: slice, width: int) -> Branch:
        count = out.stop - out.start
        return Branch(
            inputs,
            out,
            weight(width, inputs),
            weight(batch, width),
            weight(width, width),
            weight(width),
            weight(count, width),
            weight(count),
        )

    return [branch(rigid, slice(0, rigid), 6), branch(state, slice(rigid, state), 9)]


def field(parts: list[Branch], state: torch.Tensor) -> torch.Tensor:
    slopes = []
    for part in parts:
        hidden = torch.tanh(state[:, : part.inputs] @ part.w1.T + part.b1)
        slopes.append(torch.tanh(hidden @ part.w2.T + part.b2) @ part.w3.T + part.b3)
    return torch.cat(slopes, dim=1)


def by_autograd(start: torch.Tensor, parts: list[Branch]) -> torch.Tensor:
    """The classic method of Runge and Kutta, as it stands in every book."""
    states = [start]
    for step in STEPS:
        z = states[-1]
        k1 = field(parts, z)
        k2 = field(parts, z + 0.5 * step * k1)
        k3 = field(parts, z + 0.5 * step * k2)
        k4 = field(parts, z + step * k3)
        states.append(z + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4))
    return torch.stack(states)


def random_start() -> torch.Tensor:
    return torch.randn(5, 11, generator=torch.Generator().manual_seed(9), dtype=torch.float64).requires_grad_()


def test_states_are_those_of_rk4() -> None:
    parts, start = branches(0), random_start()
    assert torch.allclose(roll_out(start, STEPS, parts), by_autograd(start, parts), rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("seed", [0, 1])
def test_gradients_are_those_of_autograd(seed: int) -> None:
    parts, start = branches(seed), random_start()
    weights = [start, *(w for part in parts for w in part.weights)]
    pull = torch.randn(4, 5, 11, generator=torch.Generator().manual_seed(3), dtype=torch.float64)
    ours = torch.autograd.grad((roll_out(start, STEPS, parts) * pull).sum(), weights)
    theirs = torch.autograd.grad((by_autograd(start, parts) * pull).sum(), weights)
    for one, other in zip(ours, theirs, strict=True):
        assert torch.allclose(one, other, rtol=1e-11, atol=1e-12)


def test_a_batch_does_not_change_its_members() -> None:
    parts, start = branches(2), random_start()
    alone = [Branch(*part[:3], part.b1[2:3], *part[4:]) for part in parts]
    assert torch.allclose(roll_out(start[2:3], STEPS, alone), roll_out(start, STEPS, parts)[:, 2:3], atol=1e-14)
