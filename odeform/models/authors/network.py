"""The authors' two networks: one latent state for the whole motion, one for each point, on a grid of times.

Their local field is conditioned on the global latent state *at the second time of the query*, held constant, and both
are integrated by one step per query interval. Results are therefore tied to that grid, and valid on it alone.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from odeform.cancellation import check_cancelled
from odeform.models.authors.layers import Chain, PointNet, chunks, read_chain, tanh, waves
from odeform.solver.kutta import three_eighths
from odeform.types import Arrays, Floats, Frames, Points, Times

__all__ = ["Networks", "normalisation"]

Field = Callable[[Floats, np.float32], Floats]
PLAIN, ENCODED = 3, 39  # inputs of a point: its coordinates, and with their positional encoding


def normalisation(reference: Points) -> tuple[Float[np.ndarray, " 3"], float]:
    """Middle (3,) and half of a size in metres: the network is given (x - middle) / half.

    From the mean vertex and the smallest and largest coordinate relative to it, over all three axes.
    """
    reference = np.asarray(reference, dtype=float)
    mean = reference.mean(axis=0)
    low, high = float((reference - mean).min()), float((reference - mean).max())
    return mean + 0.5 * (low + high), 0.5 * (high - low)


def _integrated(field: Field, z: Floats, times: Times) -> list[Floats]:
    """States at the (T,) times, by one step per interval."""
    states = [z]
    for begin, end in pairwise(times):
        check_cancelled()
        states.append(three_eighths(field, states[-1], begin, end))
    return states


def _field(net: Chain, condition: Floats) -> Field:
    """dz/dt = net([z, condition, t]), one condition for all rows of z."""
    first, size = net.layers[0], net.outputs
    given = condition @ first.weight[size : size + len(condition)] + first.bias
    return lambda z, t: net.after(z @ first.weight[:size] + (given + t * first.weight[-1]))


@dataclass(frozen=True, eq=False)
class Networks:
    """Both networks. `offsets` is 1 where the global motion is a height, 3 where it is a shift."""

    encoders: tuple[Chain, Chain | PointNet]
    fields: tuple[Chain, Chain]
    decoders: tuple[Chain, Chain]

    @classmethod
    def read(cls, arrays: Arrays) -> "Networks":
        """Reads arrays named `global.…` and `local.…`. KeyError for missing arrays, ValueError for wrong sizes."""
        local: Chain | PointNet
        if "local.encoder.stn.conv1.weight" in arrays:
            local = PointNet.read(arrays, "local.encoder.")
        else:
            local = read_chain(arrays, "local.encoder.encoder_net.")
        whole = read_chain(arrays, "global.encoder.encoder_net.")
        fields = [read_chain(arrays, f"{part}.ode_func.mlp_net.", tanh) for part in ("global", "local")]
        decoders = [read_chain(arrays, f"{part}.decoder.decoder_net.") for part in ("global", "local")]
        nets = cls((whole, local), (fields[0], fields[1]), (decoders[0], decoders[1]))
        nets._check()
        return nets

    def _check(self) -> None:
        for index, part in enumerate(("global", "local")):
            latent, condition = self.encoders[index].outputs, self.encoders[0].outputs * index
            field, decoder = self.fields[index], self.decoders[index]
            if (field.inputs, field.outputs, decoder.inputs) != (latent + condition + 1, latent, latent):
                raise ValueError(f"sizes of the {part} network around a latent of {latent}")
        if (self.offsets, self.parameters) not in ((1, 2), (3, 6)) or self.decoders[1].outputs != 3:
            raise ValueError(f"sizes: offsets of {self.offsets} numbers under {self.parameters} parameters")
        allowed = (PLAIN,) if isinstance(self.encoders[1], PointNet) else (PLAIN, ENCODED)
        if self.encoders[1].inputs - self.parameters not in allowed:
            raise ValueError(f"size of the local encoder's input, {self.encoders[1].inputs}")

    @property
    def offsets(self) -> int:
        """Size of the initial offset: 1 or 3."""
        return self.decoders[0].outputs

    @property
    def parameters(self) -> int:
        """Number of parameters of the scene."""
        return self.encoders[0].inputs - self.offsets

    @property
    def encoded(self) -> bool:
        """Whether points are given with a positional encoding."""
        return self.encoders[1].inputs - self.parameters == ENCODED

    @property
    def kind(self) -> str:
        """The local encoder, by the authors' name."""
        if isinstance(self.encoders[1], PointNet):
            return "pointnet_bn" if self.encoders[1].normed else "pointnet"
        return "pemlp" if self.encoded else "mlp"

    def solve(
        self,
        points: Points,
        theta: Float[np.ndarray, " parameters"],
        offset: Float[np.ndarray, " offsets"],
        times: Times,
    ) -> tuple[Float[np.ndarray, "times offsets"], Frames]:
        """Returns offsets (T, 1 or 3) and shapes (T, N, 3) at the (T,) times, all in the units of the networks.

        `points` (N, 3), parameters `theta` and the first `offset` are normalised. Points are processed in chunks.
        """
        theta, points, times = (np.asarray(x, dtype=np.float32) for x in (theta, points, times))
        start = self.encoders[0](np.concatenate([np.asarray(offset, dtype=np.float32), theta])[None])
        whole = _integrated(_field(self.fields[0], np.zeros(0, np.float32)), start, times)
        field = _field(self.fields[1], whole[1][0])
        shapes = np.empty((len(times), len(points), 3), dtype=np.float32)
        transform = self.encoders[1].transform(points) if isinstance(self.encoders[1], PointNet) else None
        for part in chunks(len(points)):
            for frame, z in enumerate(_integrated(field, self._latents(points[part], theta, transform), times)):
                shapes[frame, part] = self.decoders[1](z)
        return np.stack([self.decoders[0](z)[0] for z in whole]), shapes

    def _latents(self, points: Points, theta: Floats, transform: Floats | None) -> Floats:
        """(N, latent) states of the points at the start."""
        inputs = waves(points) if self.encoded else points if transform is None else points @ transform
        rows = np.concatenate([inputs, np.tile(theta, (len(points), 1))], axis=1)
        encoder = self.encoders[1]
        return encoder.encode(rows) if isinstance(encoder, PointNet) else encoder(rows)
