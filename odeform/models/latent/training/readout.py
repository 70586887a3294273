"""Solves for the readout of a decoder, which is not descended in, and draws random features that widen it.

A readout is linear, so its best value for given features is a least-squares solve.
"""

import torch

__all__ = ["NormalEquations", "random_layer"]

STATE_SLOPES = (0.1, 1.0)
CLOCK_SLOPES = (1.0, 10.0)
PARAMETER_SLOPES = (0.1, 1.0)
"""Slopes of random features at sharpness 1: per standard deviation of the principal components together, per unit of
the clock, and of parameters. Each feature draws its own between these, uniformly on a logarithmic scale: contacts are
short, and the motion after a bounce depends on the parameters more finely than the motion before.
"""


def _squared(x: torch.Tensor) -> torch.Tensor:
    """x.T x; on a CPU by numpy, which computes only one half."""
    if x.device.type != "cpu":
        return x.T @ x
    rows = x.numpy()
    return torch.from_numpy(rows.T @ rows)


class NormalEquations:
    """The normal equations of one decoder's readout, in double precision; features may be added in chunks."""

    def __init__(self) -> None:
        self._gram: torch.Tensor | None = None

    def add(self, features: torch.Tensor, truth: torch.Tensor, weights: torch.Tensor) -> None:
        """Adds features (T, B, F) and targets (T, B, outputs), with weights (T, B) of squares; without frame 0,
        where both vanish."""
        features, truth = (weights.sqrt()[..., None] * v for v in (features, truth))
        x, y = (v[1:].flatten(0, 1).double() for v in (features, truth))
        gram, cross = _squared(x), x.T @ y
        self._gram, self._cross = (gram, cross) if self._gram is None else (self._gram + gram, self._cross + cross)

    def solve(self, ridge: float) -> torch.Tensor:
        """The readout (outputs, F), with a ridge relative to the mean square of a feature."""
        assert self._gram is not None
        gram = self._gram.clone()
        gram.diagonal().add_(ridge * gram.diagonal().mean() + 1e-30)
        return torch.linalg.solve(gram, self._cross).T


def random_layer(
    inputs: list[torch.Tensor],
    parameters: int,
    components: int,
    count: int,
    sharpness: float,
    generator: torch.Generator,
) -> dict[str, torch.Tensor]:
    """Draws the weights of two linear layers: whitened principal components of the inputs, and random directions in
    them.

    `inputs` are chunks (rows, inputs), of which the last columns, the clock and `parameters` in [-1, 1], are passed on
    unchanged. Weights are rounded to single precision, as checkpoints store them.
    """
    conditions = 1 + parameters
    split = inputs[0].shape[1] - conditions
    rows = sum(len(x) for x in inputs)
    mean = torch.stack([x[:, :split].double().sum(dim=0) for x in inputs]).sum(dim=0) / rows
    spread = torch.stack([(c := x[:, :split].double() - mean).T @ c for x in inputs]).sum(dim=0) / rows
    values, vectors = torch.linalg.eigh(spread)
    values, vectors = values.flip(0)[:components], vectors.flip(1)[:, :components]
    # directions without motion carry nothing but rounding
    scales = torch.where(values > 1e-10 * values[0], values.clamp_min(1e-300).rsqrt(), 0.0)
    squeeze = torch.zeros(components + conditions, split + conditions, dtype=torch.float64)
    squeeze[:components, :split] = scales[:, None] * vectors.T
    squeeze[components:, split:] = torch.eye(conditions, dtype=torch.float64)
    offset = torch.cat([-squeeze[:components, :split] @ mean, torch.zeros(conditions, dtype=torch.float64)])
    draw = {"generator": generator, "dtype": torch.float64, "device": generator.device}
    directions, squared = [], torch.zeros(count, dtype=torch.float64, device=generator.device)
    for width, (low, high) in ((components, STATE_SLOPES), (1, CLOCK_SLOPES), (parameters, PARAMETER_SLOPES)):
        slopes = sharpness * low * (high / low) ** torch.rand(count, **draw)
        directions.append(slopes[:, None] / width**0.5 * torch.randn(count, width, **draw))
        squared += slopes**2
    biases = squared.sqrt() * (2.0 * torch.rand(count, **draw) - 1.0)
    layers = {"0.weight": squeeze, "0.bias": offset, "2.weight": torch.cat(directions, dim=1), "2.bias": biases}
    return {name: value.float() for name, value in layers.items()}
