from dataclasses import replace

import numpy as np

from odeform.types import MotionSequence


def counting(frames: int = 6, rate: float = 10.0) -> MotionSequence:
    """Four points whose coordinates are the number of the frame."""
    vertices = np.repeat(np.arange(float(frames)), 12).reshape(frames, 4, 3)
    faces = np.array([[0, 1, 2]])
    return MotionSequence(np.arange(frames) / rate, vertices, faces, np.full(4, 0.25), {"mass": 0.5}, "s")


def shown(sequence: MotionSequence) -> list[float]:
    assert np.ptp(sequence.vertices, axis=(1, 2)).max() == 0.0
    return sequence.vertices[:, 0, 0].tolist()


def test_until_cuts_behind_the_frame_of_that_time() -> None:
    cut = counting().until(0.3)
    assert shown(cut) == [0.0, 1.0, 2.0, 3.0]
    assert np.allclose(cut.times, [0.0, 0.1, 0.2, 0.3])
    assert (cut.parameters, cut.name) == ({"mass": 0.5}, "s")


def test_until_holds_what_ended_before() -> None:
    held = counting().until(0.8)
    assert shown(held) == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 5.0, 5.0, 5.0]
    assert np.allclose(held.times, np.arange(9) / 10.0)


def test_until_takes_every_kth_frame() -> None:
    assert shown(counting().until(0.5, every=2)) == [0.0, 2.0, 4.0]
    held = counting().until(0.9, every=3)
    # frame 6 is not there: the last one stands for it, although it is no multiple of three
    assert shown(held) == [0.0, 3.0, 5.0, 5.0]
    assert np.allclose(held.times, [0.0, 0.3, 0.6, 0.9])


def test_until_of_a_rate_that_is_no_round_number() -> None:
    long = counting(frames=481, rate=480.0)
    long = replace(long, times=long.times.astype(np.float32).astype(float))
    assert len(long.until(1.0).times) == 481
    assert shown(long.until(1.0, every=4)) == list(range(0, 481, 4))
