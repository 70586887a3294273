"""The playback clock."""

from collections.abc import Callable

import pytest

from odeform_viz.runtime.clock import Clock


class Wall:
    """A clock that only the test moves."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def wall() -> Wall:
    return Wall()


def test_plays_at_speed_and_pauses(wall: Wall) -> None:
    clock = Clock(0.0, 1.0, wall)
    clock.set_speed(0.2)
    clock.play()
    wall.now += 2.0
    assert clock.time() == pytest.approx(0.4)
    clock.pause()
    wall.now += 5.0
    assert clock.time() == pytest.approx(0.4)


def test_changing_speed_does_not_jump(wall: Wall) -> None:
    clock = Clock(0.0, 1.0, wall)
    clock.play()
    wall.now += 0.3
    clock.set_speed(0.1)
    assert clock.time() == pytest.approx(0.3)
    wall.now += 1.0
    assert clock.time() == pytest.approx(0.4)


def test_loops_within_the_window(wall: Wall) -> None:
    clock = Clock(0.0, 1.0, wall)
    clock.play()
    wall.now += 1.25
    assert clock.time() == pytest.approx(0.25)
    wall.now += 0.5
    assert clock.time() == pytest.approx(0.75)


def test_without_loop_stops_at_the_end_and_then_starts_over(wall: Wall) -> None:
    clock = Clock(0.0, 1.0, wall)
    clock.loop = False
    clock.play()
    wall.now += 3.0
    assert clock.time() == 1.0
    assert not clock.playing
    clock.play()
    assert clock.time() == 0.0


def test_seeking_beyond_the_window_is_allowed(wall: Wall) -> None:
    clock = Clock(0.0, 1.0, wall)
    clock.seek(1.4)
    assert clock.time() == 1.4


def test_an_interval_is_played_slowly_once(wall: Wall) -> None:
    clock = Clock(0.0, 1.0, wall)
    clock.slow_down_once(0.2, 0.3, 2.0)
    clock.play()
    moments = []
    for _ in range(6):
        wall.now += 0.5
        moments.append(clock.time())
    assert moments == pytest.approx([0.215, 0.24, 0.265, 0.29, 0.6, 0.1], abs=1e-9)
    wall.now += 0.3
    assert clock.time() == pytest.approx(0.4)  # not slowly again


@pytest.mark.parametrize(
    "interrupt", [lambda c: c.seek(0.1), lambda c: c.set_speed(1.0), lambda c: (c.pause(), c.play())]
)
def test_what_the_user_does_ends_the_slow_interval(wall: Wall, interrupt: Callable[[Clock], object]) -> None:
    clock = Clock(0.0, 1.0, wall)
    clock.slow_down_once(0.0, 0.5, 50.0)
    clock.play()
    interrupt(clock)
    before = clock.time()
    wall.now += 0.4
    assert clock.time() == pytest.approx(before + 0.4)
