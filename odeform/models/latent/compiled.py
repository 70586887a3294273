"""The field of the latent ODEs as plain loops, which Numba compiles: `inference.make_field` is the same in NumPy."""

from collections.abc import Callable
from itertools import pairwise
from typing import no_type_check

import numpy as np

from odeform.models.latent.config import ModelConfig
from odeform.models.latent.weights import field_layers
from odeform.solver.compiled import CompiledField
from odeform.types import Arrays, Floats, Ints

__all__ = ["make_compiled_field"]

DOUBLINGS = 8
PART = 2.0 / 2**DOUBLINGS


def make_compiled_field(weights: Arrays, config: ModelConfig, dtype: type) -> Callable[[Floats], CompiledField]:
    """theta (P,) -> the field dz/dt = f(z). Matrices are laid out once; new parameters only change a bias."""
    layers = field_layers(weights, config)
    hidden = np.cumsum([0, *(config.sizes(branch)["field"][1] for branch in config.branches)]).tolist()
    count, state = hidden[-1], config.state
    blocks, matrices, at = [], [], 0
    for number, (out, inner) in enumerate(zip(config.states, pairwise(hidden), strict=True)):
        units, (low, *_) = slice(*inner), out.indices(state)
        seen = config.sizes(config.branches[number])["field"][0] - config.parameters
        parts = (
            # where the inputs begin, the matrix, and where the outputs begin
            (0, layers.first[units, :seen], state + inner[0]),
            (state + inner[0], layers.middle[units, units], state + count + inner[0]),
            (state + count + inner[0], layers.last[out, units], state + 2 * count + low),
        )
        for begin, matrix, to in parts:
            blocks.append((begin, matrix.shape[1], to, matrix.shape[0], at))
            matrices.append(matrix.T.ravel())  # one input after the other
            at += matrix.size
    shared, sizes = np.concatenate(matrices).astype(dtype), np.array(blocks).ravel()

    def fold(theta: Floats) -> CompiledField:
        first, *others = layers.biases
        own = np.concatenate([first + layers.conditioning @ theta, *others])
        return CompiledField(_slope, own.astype(dtype), shared, sizes)

    return fold


@no_type_check
def _slope(state: Floats, own: Floats, shared: Floats, sizes: Ints, out: Floats) -> None:
    """Layers with tanh after all but the last. `own` are biases, `sizes` for each block of a layer: where its inputs
    begin, how many, where its outputs begin, how many, and where its matrix begins in `shared`."""
    size = len(state)
    values = np.empty(size + len(own), state.dtype)
    values[:size], values[size:] = state, own
    last = len(values) - size
    for block in range(len(sizes) // 5):
        begin, count, to, width, at = sizes[5 * block : 5 * block + 5]
        outputs = values[to : to + width]
        whole = count - count % 4
        for i in range(begin, begin + whole, 4):  # four at once: sums are read and written once for all of them
            one, two, three, four = values[i], values[i + 1], values[i + 2], values[i + 3]
            by_one, by_two = shared[at : at + width], shared[at + width : at + 2 * width]
            by_three, by_four = shared[at + 2 * width : at + 3 * width], shared[at + 3 * width : at + 4 * width]
            for j in range(width):
                outputs[j] += (by_one[j] * one + by_two[j] * two) + (by_three[j] * three + by_four[j] * four)
            at += 4 * width
        for i in range(begin + whole, begin + count):
            for j in range(width):
                outputs[j] += shared[at + j] * values[i]
            at += width
        if to < last:
            for j in range(width):
                # tanh x = m / (m + 2), m = exp(2 x) - 1: of a small part of x by its series, and doubled
                part = PART * min(max(outputs[j], -20.0), 20.0)
                grown = part * (1.0 + part / 2.0 * (1.0 + part / 3.0 * (1.0 + part / 4.0 * (1.0 + part / 5.0))))
                for _ in range(DOUBLINGS):
                    grown *= grown + 2.0
                outputs[j] = grown / (grown + 2.0)
    out[:] = values[last:]
