"""A base for families whose vector field is a module of PyTorch: what is left to write is the module."""

import copy
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import torch
from torch import nn

from odeform.checkpoint import Checkpoint
from odeform.models.model import Model
from odeform.models.solved import Problem
from odeform.motion.evaluated_basis import EvaluatedBasis
from odeform.types import Arrays, Floats

if TYPE_CHECKING:
    from odeform.models.training.run import Run

__all__ = ["NeuralModel", "network_arrays"]

PREFIX = "net."


class NeuralModel(Model):
    """A model of reduced coordinates dz/dt = f(t, z, theta) whose f is a `torch.nn.Module`.

    A subclass sets `model`, its name, and `network`, a module that is constructed as `network(P, C, **settings)` for P
    parameters and C coordinates: shift, rotation vector, and coefficients of the deformation's modes (of a body that
    rolls: of patterns that do not turn with it). It has three methods; (B,) motions are computed together, and theta
    (B, P) is in [-1, 1]:

    - `initial_state(theta)` -> (B, S), the state at time 0;
    - `vector_field(t, z, theta)` -> (B, S), the slope per second of z (B, S) at t seconds, a number; derivatives that
      it takes by `torch.autograd` need `torch.enable_grad()`, since predictions keep no graph;
    - `readout(t, z, theta)` -> (B, C), the coordinates in units of their root mean square, at t (B,) seconds. Their
      value at time 0 is subtracted, so that a body starts at rest.

    It is trained by Adam on whole motions, from a quarter of their length on, and keeps the weights that are best on
    validation (`odeform.models.training.neural_fit`).

    Examples:
        >>> import odeform, torch
        >>> class Network(torch.nn.Module):
        ...     def __init__(self, parameters, coordinates):
        ...         super().__init__()
        ...         self.slope = torch.nn.Linear(coordinates + parameters, coordinates)
        ...
        ...     def initial_state(self, theta):
        ...         return theta.new_zeros(len(theta), self.slope.out_features)
        ...
        ...     def vector_field(self, t, z, theta):
        ...         return self.slope(torch.cat([z, theta], dim=1))
        ...
        ...     def readout(self, t, z, theta):
        ...         return z
        >>> class Linear(odeform.NeuralModel):
        ...     model, network = "linear", Network
        >>> odeform.register_model("linear", Linear)
    """

    network: type[nn.Module]
    settings: ClassVar[Mapping[str, Any]] = {}
    """Further arguments of `network`, plain values, which checkpoints store."""
    rate: ClassVar[float] = 2e-3
    """Learning rate, which decays to 0 along a cosine."""
    batch: ClassVar[int] = 32
    """Motions in a step of descent."""
    resumable = True
    descends = True

    @classmethod
    def train(cls, run: "Run") -> Checkpoint:
        from odeform.models.training.neural_fit import train_neural

        return train_neural(cls, run)

    def _read(self, checkpoint: Checkpoint) -> None:
        super()._read(checkpoint)
        module = self.network(len(self.schema.learned), self.space.coordinates, **checkpoint.config["network"])
        arrays = {k.removeprefix(PREFIX): v for k, v in checkpoint.arrays.items() if k.startswith(PREFIX)}
        try:
            module.load_state_dict({name: torch.tensor(value) for name, value in arrays.items()})
        except RuntimeError as error:
            raise ValueError(f"weights of {self.network.__name__}: {error}") from None
        module.eval().requires_grad_(False)
        self._scale = checkpoint.arrays["scale"].astype(float)
        self._modules = {np.float32: module, np.float64: copy.deepcopy(module).double()}

    def problem(self, theta: Floats, evaluated: EvaluatedBasis, dtype: type = np.float64) -> Problem:
        module: Any = self._modules[dtype]
        known = torch.tensor(theta[None].astype(dtype))

        def field(time: float, state: Floats) -> Floats:
            # not in inference mode: a field may be the derivative of an energy
            with torch.no_grad():
                return module.vector_field(time, torch.from_numpy(state)[None], known)[0].detach().numpy()

        def readout(times: Floats, states: Floats) -> Floats:
            at, rows = torch.tensor(times.astype(dtype)), torch.from_numpy(np.ascontiguousarray(states, dtype=dtype))
            with torch.no_grad():
                out = module.readout(at, rows, known.expand(len(rows), -1))
            return out.detach().numpy().astype(float) * self._scale

        with torch.no_grad():
            start = module.initial_state(known)[0].detach().numpy()
        origin = readout(np.zeros(1), start[None])
        return Problem(field, start, lambda times, states: readout(times, states) - origin)


def network_arrays(module: nn.Module) -> Arrays:
    """The weights of a module, as a checkpoint stores them."""
    return {PREFIX + name: value.detach().cpu().numpy() for name, value in module.state_dict().items()}
