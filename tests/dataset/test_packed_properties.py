"""The integer codec of packed data sets, for any series and any bytes."""

import lzma
import struct

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from properties import PROPERTY

from odeform.dataset.body_codec import fit_codec
from odeform.dataset.integers import expanded, from_planes, planes_of, squeezed
from odeform.geometry.rigid import rotation_from_vector
from odeform.types import MotionSequence

QUICK = settings(PROPERTY, max_examples=20)  # each allocates the dictionary of a compressor
SERIES = arrays(np.int64, array_shapes(min_dims=2, max_dims=2, max_side=12), elements=st.integers(-(2**28), 2**28))


@QUICK
@given(SERIES, st.floats(1e-3, 1e6))
def test_integers_come_back_exactly(values: np.ndarray, rate: float) -> None:
    again, its_rate = expanded(squeezed(values, rate))
    assert np.array_equal(again, values)
    assert its_rate == rate


@QUICK
@given(SERIES, st.binary(max_size=40), st.integers(0, 2**16), st.booleans())
def test_damaged_bytes_are_refused_or_harmless(values: np.ndarray, junk: bytes, at: int, cut: bool) -> None:
    """The decoder raises nothing but what `open_packed` reports; only an end mark may be missing."""
    whole = squeezed(values, 120.0)
    try:
        again, _ = expanded(whole[: at % len(whole)] if cut else junk)
    except (lzma.LZMAError, struct.error, ValueError):
        return
    assert np.array_equal(again, values)


@PROPERTY
@given(SERIES)
def test_planes_come_back_exactly(values: np.ndarray) -> None:
    again = from_planes(np.frombuffer(planes_of(values), np.uint8), (values.shape[0], values.shape[1]))
    assert np.array_equal(again, values)


@QUICK
@given(st.integers(0, 2**16), st.sampled_from([1e-5, 1e-4, 1e-3]), st.floats(0.0, 0.03), st.integers(1, 9))
def test_every_vertex_comes_back_within_the_tolerance(seed: int, tolerance: float, size: float, frames: int) -> None:
    """Any deformation, rough ones too, which modes of other motions do not span."""
    rng = np.random.default_rng(seed)
    rest = 0.1 * rng.normal(size=(10, 3))

    def moved(rough: float) -> MotionSequence:
        local = rest + size * np.arange(frames)[:, None, None] * rng.normal(size=(10, 3)) / frames
        local = local + rough * rng.normal(size=(frames, 10, 3)) * (np.arange(frames) > 0)[:, None, None]
        turn = rotation_from_vector(np.arange(frames)[:, None] * rng.normal(size=3))
        vertices = local @ turn.swapaxes(1, 2) + np.arange(frames)[:, None, None] * rng.normal(size=3)
        faces = np.array([[0, 1, 2]], dtype=np.int32)
        return MotionSequence(np.arange(frames) / 100.0, vertices.astype(np.float32), faces, np.full(10, 0.1))

    codec, data = fit_codec(lambda: iter([moved(0.0)]), tolerance)
    read = type(codec).from_bytes(data, {"quantum_m": codec.quantum, "correction_m": codec.correction})
    for truth in (moved(0.0), moved(size)):
        vertices = read.decode(codec.encode(truth, 100.0))[1]
        assert np.linalg.norm(vertices.astype(float) - truth.vertices, axis=2).max() <= tolerance
