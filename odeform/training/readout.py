"""What is solved for rather than descended to: the readout of a decoder, and random features that make it wider.

A readout is linear, so its best value for any features is a least-squares solve.
"""

import torch

__all__ = ["NormalEquations", "random_layer"]

SPREAD = 0.15
"""Of the random directions, per unit of standard deviation of what they see: features bend over several of them."""


class NormalEquations:
    """Those of one decoder's readout, in double precision; features may come in chunks."""

    def __init__(self) -> None:
        self._gram: torch.Tensor | None = None

    def add(self, features: torch.Tensor, truth: torch.Tensor) -> None:
        """(T, B, F) and (T, B, outputs), without frame 0, where features and truth vanish."""
        x, y = (v[1:].flatten(0, 1).double() for v in (features, truth))
        gram, cross = x.T @ x, x.T @ y
        self._gram, self._cross = (gram, cross) if self._gram is None else (self._gram + gram, self._cross + cross)

    def solve(self, ridge: float) -> torch.Tensor:
        """(outputs, F), with a ridge relative to the mean square of a feature."""
        assert self._gram is not None
        gram = self._gram.clone()
        gram.diagonal().add_(ridge * gram.diagonal().mean() + 1e-30)
        return torch.linalg.solve(gram, self._cross).T


def random_layer(
    seen: list[torch.Tensor], parameters: int, components: int, count: int, generator: torch.Generator
) -> dict[str, torch.Tensor]:
    """Weights of two linear layers: whitened principal components of what is seen, and random directions in them.

    `seen` are (rows, inputs) of which the last `parameters` columns, in [-1, 1], are passed on as they are. Values are
    rounded to single precision, as checkpoints keep them.
    """
    split = seen[0].shape[1] - parameters
    rows = sum(len(x) for x in seen)
    mean = torch.stack([x[:, :split].double().sum(dim=0) for x in seen]).sum(dim=0) / rows
    spread = torch.stack([(c := x[:, :split].double() - mean).T @ c for x in seen]).sum(dim=0) / rows
    values, vectors = torch.linalg.eigh(spread)
    values, vectors = values.flip(0)[:components], vectors.flip(1)[:, :components]
    # directions without motion carry nothing but rounding
    gains = torch.where(values > 1e-10 * values[0], values.clamp_min(1e-300).rsqrt(), 0.0)
    squeeze = torch.zeros(components + parameters, split + parameters, dtype=torch.float64)
    squeeze[:components, :split] = gains[:, None] * vectors.T
    squeeze[components:, split:] = torch.eye(parameters, dtype=torch.float64)
    offset = torch.cat([-squeeze[:components, :split] @ mean, torch.zeros(parameters, dtype=torch.float64)])
    directions = SPREAD * torch.randn(count, components + parameters, generator=generator, dtype=torch.float64)
    biases = 2.0 * torch.rand(count, generator=generator, dtype=torch.float64) - 1.0
    layers = {"0.weight": squeeze, "0.bias": offset, "2.weight": directions, "2.bias": biases}
    return {name: value.float() for name, value in layers.items()}
