"""The integer codec of packed data sets, for any series and any bytes."""

import lzma
import struct

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from properties import PROPERTY

from odeform.dataset.packed import _expand, _squeeze

QUICK = settings(PROPERTY, max_examples=20)  # each allocates the dictionary of a compressor
SERIES = arrays(np.int64, array_shapes(min_dims=2, max_dims=2, max_side=12), elements=st.integers(-(2**28), 2**28))


@QUICK
@given(SERIES, st.floats(1e-3, 1e6))
def test_integers_come_back_exactly(values: np.ndarray, rate: float) -> None:
    again, its_rate = _expand(_squeeze(values, rate))
    assert np.array_equal(again, values)
    assert its_rate == rate


@QUICK
@given(SERIES, st.binary(max_size=40), st.integers(0, 2**16), st.booleans())
def test_damaged_bytes_are_refused_or_harmless(values: np.ndarray, junk: bytes, at: int, cut: bool) -> None:
    """The decoder raises nothing but what `open_packed` reports; only an end mark may be missing."""
    whole = _squeeze(values, 120.0)
    try:
        again, _ = _expand(whole[: at % len(whole)] if cut else junk)
    except (lzma.LZMAError, struct.error, ValueError):
        return
    assert np.array_equal(again, values)
