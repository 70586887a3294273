"""Every k-th frame of a data set, the same of all sequences or interleaved."""

from dataclasses import replace

import numpy as np
import pytest

from odeform.dataset.index import Dataset
from odeform.dataset.subsampling import FrameSubsampling, observed_frames
from odeform.dataset.training_data import prepare
from odeform.errors import InputError


@pytest.mark.parametrize("stagger", [False, True])
def test_known_frames_are_as_they_were(dataset: Dataset, stagger: bool) -> None:
    whole, few = prepare(dataset, modes=8), prepare(dataset, 8, FrameSubsampling(every=3, stagger=stagger))
    known = few.observed["train"]
    assert known[:, 0].all()
    assert (known.sum(axis=1) <= len(few.times) // 3 + 2).all()
    # poses do not depend on the basis, which is fitted to the frames that are known
    same = whole.reduced["train"][:, : len(few.times), :6]
    apart = np.abs(few.reduced["train"][..., :6] - same).max(axis=-1)
    assert apart[known].max() < 1e-9
    assert apart[~known].max() > 1e-6


def test_the_same_frames_of_all_or_interleaved() -> None:
    assert FrameSubsampling(every=5).kept(21, 3).tolist() == [0, 5, 10, 15, 20]
    assert FrameSubsampling(every=5, stagger=True).kept(21, 3).tolist() == [0, 3, 8, 13, 18, 20]
    shown = [FrameSubsampling(every=5, stagger=True).kept(21, sequence) for sequence in range(5)]
    assert set(np.concatenate(shown)) == set(range(21))


def test_each_sequence_shows_its_frames() -> None:
    subsampling = FrameSubsampling(every=5, stagger=True)
    frames, shows = observed_frames(subsampling.observed(21, 5))
    for sequence in range(5):
        assert frames[sequence][shows[sequence]].tolist() == subsampling.kept(21, sequence).tolist()
    assert shows[:, 0].all()
    assert not shows.all()  # the first of them shows one frame less


def test_a_window_ends_with_a_known_frame(dataset: Dataset) -> None:
    assert FrameSubsampling(every=7).count(dataset.schema) == 120
    assert FrameSubsampling((0, 50), every=8).count(dataset.schema) == 49
    assert FrameSubsampling((0, 50), every=8, stagger=True).count(dataset.schema) == 50


def test_a_parabola_is_filled_in_exactly() -> None:
    subsampling, frames = FrameSubsampling(every=4), np.arange(33.0)
    fall = frames[:, None] ** 2 * [1.0, -0.5]
    assert np.allclose(subsampling.interpolated(fall[subsampling.kept(33, 0)], 33, 0), fall, atol=1e-9)


def test_too_few_frames(dataset: Dataset) -> None:
    with pytest.raises(InputError, match="at least 4 training frames"):
        prepare(dataset, 8, FrameSubsampling(every=60))
    with pytest.raises(InputError, match="start at frame 0"):
        prepare(dataset, 8, FrameSubsampling((3, 60)))


def test_finer_recordings_are_learned_from_at_the_rate_of_the_scene(dataset: Dataset) -> None:
    slow = replace(dataset.schema, window=replace(dataset.schema.window, rate=dataset.schema.window.rate / 2.0))
    coarse = prepare(replace(dataset, schema=slow), modes=8)
    whole = prepare(dataset, modes=8)
    assert np.allclose(coarse.reduced["train"][..., :6], whole.reduced["train"][:, ::2, :6], atol=1e-12)
