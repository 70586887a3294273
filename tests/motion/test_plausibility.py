"""A motion that leaves the physical shows its last valid moment, however it is asked."""

from collections.abc import Callable

import numpy as np
import pytest

from odeform.motion.limits import Limits
from odeform.motion.plausibility import SLACK, PlausibilityCheck, Sample, Stop
from odeform.schema import Window
from odeform.types import Floats, Times

WINDOW = Window(0.0, 1.0, 60.0, 0.5)
LIMITS = Limits(floor=0.0)
Curve = Callable[[Times], Floats]


def plausibility(
    lowest: Curve = np.zeros_like, deformation: Curve = np.zeros_like, height: Curve = np.zeros_like
) -> tuple[PlausibilityCheck, list[Times]]:
    """A watch over a motion given by formulas, and the times that it looked at."""
    asked: list[Times] = []

    def sample(times: Times) -> Sample:
        asked.append(times)
        centre = np.zeros((len(times), 3))
        centre[:, 2] = height(times)
        return Sample(lowest(times), deformation(times), centre)

    return PlausibilityCheck(LIMITS, WINDOW, sample), asked


def falling(times: Times) -> Floats:
    """Through the limit of 5 mm at 1.2 s."""
    return np.where(times > 1.0, -(0.005 - SLACK) * (times - 1.0) / 0.2, 0.0)


def dipping(times: Times) -> Floats:
    """Below the limit from 0.4 to 0.5 s."""
    return np.where((times > 0.4) & (times < 0.5), -0.006, 0.0)


def test_a_sound_motion_is_shown_as_it_is() -> None:
    valid, _ = plausibility(lowest=lambda t: np.full_like(t, -0.0047))
    times = np.linspace(0.0, 1.55, 40)
    assert np.array_equal(valid.clamped(times), times)
    assert valid.stop_at(1.5) is None
    assert valid.first_stop(1.55) is None


def test_after_the_window_it_ends_where_it_first_sinks() -> None:
    sinking, _ = plausibility(lowest=falling)
    times = np.array([0.3, 1.1, 1.199, 1.3, 1.5])
    shown = sinking.clamped(times)
    assert np.array_equal(shown[:3], times[:3])
    assert shown[3] == shown[4] == pytest.approx(1.2, abs=2e-5)
    assert falling(shown).min() >= -0.005
    assert sinking.stop_at(1.5) == Stop(shown[4], "it sinks into the floor")
    assert sinking.stop_at(1.1) is None
    assert sinking.first_stop(1.5) == sinking.stop_at(1.5)


def test_what_is_inside_an_obstacle_is_said_to_be_so() -> None:
    def sample(times: Times) -> Sample:
        return Sample(falling(times), np.zeros(len(times)), np.zeros((len(times), 3)), times > 0.0)

    stop = PlausibilityCheck(LIMITS, WINDOW, sample, "wall").stop_at(1.5)
    assert stop is not None
    assert stop.reason == "it sinks into the wall"


def test_in_the_window_each_moment_is_checked_by_itself() -> None:
    dip, asked = plausibility(lowest=dipping)
    assert dip.clamped(np.array([0.7])).tolist() == [0.7]
    assert [len(times) for times in asked] == [1]  # nothing else had to be looked at
    shown = dip.clamped(np.array([0.41, 0.45, 0.499, 0.51]))
    assert shown[:3] == pytest.approx(np.full(3, 0.4), abs=2e-5)
    assert shown[3] == 0.51
    assert dip.first_stop(1.5) == dip.stop_at(0.45)


@pytest.mark.parametrize("lowest", [falling, dipping, lambda t: np.where(t > 0.98, -0.01, 0.0)])
def test_the_result_depends_neither_on_the_order_nor_on_the_grid(lowest: Curve) -> None:
    times = np.random.default_rng(0).uniform(0.0, 1.55, 200)
    whole, _ = plausibility(lowest)
    expected = whole.clamped(times)
    one_by_one, backwards = plausibility(lowest)[0], plausibility(lowest)[0]
    assert [float(one_by_one.clamped(np.array([time]))[0]) for time in times] == expected.tolist()
    descending = np.argsort(times)[::-1]
    assert np.array_equal(backwards.clamped(times[descending]), expected[descending])
    late, _ = plausibility(lowest)
    late.clamped(np.array([1.55]))
    assert np.array_equal(late.clamped(times), expected)


def test_numbers_that_are_not_finite_stop_it() -> None:
    lost, _ = plausibility(lowest=lambda t: np.where(t > 1.3, np.nan, 0.0))
    stop = lost.stop_at(1.5)
    assert stop is not None
    assert (stop.time, stop.reason) == (pytest.approx(1.3, abs=2e-5), "it is not finite")
    assert lost.clamped(np.array([1.5]))[0] <= 1.3


def test_impossible_deformations_stop_it() -> None:
    wild, _ = plausibility(deformation=lambda t: np.where(t > 0.6, 1.4, 1.2))
    stop = wild.stop_at(0.9)
    assert stop is not None
    assert (stop.time, stop.reason) == (pytest.approx(0.6, abs=2e-5), "it deforms more than such a body can")


def test_energy_from_nowhere_stops_it() -> None:
    """A ball that bounces is valid; one that rises higher than it ever was, without any contact, is not."""

    def valid(times: Times) -> Floats:
        return 0.5 * np.abs(np.cos(3.0 * times)) * np.exp(-0.5 * times)

    def driven(times: Times) -> Floats:
        return np.where(times > 1.2, valid(np.array([1.2])) + 3.0 * (times - 1.2), valid(times))

    assert plausibility(height=valid)[0].first_stop(1.5) is None
    stop = plausibility(height=driven)[0].first_stop(1.5)
    assert stop is not None
    assert stop.time + 1.0 / 60.0 >= 1.2
    assert stop.time < 1.35
    assert stop.reason == "it gains energy"


def test_energy_is_compared_with_a_tenth_more_than_the_largest_in_the_window() -> None:
    """A ball that swings by half a metre and is lifted slowly afterwards: where it is lifted by a tenth of that."""

    def lifted(times: Times) -> Floats:
        return np.where(times > 1.0, 0.5 + 0.2 * (times - 1.0), 0.5 * np.cos(np.pi * times) ** 2)

    stop = plausibility(height=lifted)[0].first_stop(1.5)
    assert stop is not None
    assert stop.reason == "it gains energy"
    # the largest energy is looked up a sixteenth of the window before its end: 4.89 of 4.905 J/kg
    assert stop.time == pytest.approx(1.0 + (1.1 * 4.89 - 4.905 - 0.02) / (0.2 * 9.81), abs=0.01)


def test_a_scene_without_a_floor_has_none_to_sink_into() -> None:
    free = PlausibilityCheck(
        Limits(None), WINDOW, lambda t: Sample(np.full(len(t), -9.0), np.zeros(len(t)), np.zeros((len(t), 3)))
    )
    assert free.first_stop(1.5) is None


def test_a_motion_that_never_was_sound_stays_at_rest() -> None:
    broken, _ = plausibility(lowest=lambda t: np.where(t > 0.0, -1.0, 0.0))
    assert broken.clamped(np.array([0.0, 0.2, 1.0, 1.5])) == pytest.approx(np.zeros(4), abs=1e-4)


@pytest.mark.parametrize("step", [1, 2, 40, *range(42, 49), 57])
def test_after_the_window_no_moment_of_the_grid_is_left_out(step: int) -> None:
    """It sinks for the length of one interval, wherever that is among those that are checked at once."""
    moment = 1.0 + step / 120.0
    brief, _ = plausibility(lowest=lambda t: np.where(np.abs(t - moment) < 0.4 / 120.0, -0.01, 0.0))
    stop = brief.stop_at(1.55)
    assert stop is not None
    assert stop.time == pytest.approx(moment - 0.4 / 120.0, abs=2e-5)
    assert brief.stop_at(moment - 0.5 / 120.0) is None


def test_mechanics_goes_on_after_a_moment_that_is_not_valid() -> None:
    def sample(times: Times) -> Sample:
        low = np.where((times > 1.2) & (times < 1.3), -0.006, 0.0)
        return Sample(low, np.zeros_like(times), np.zeros((len(times), 3)))

    check = PlausibilityCheck(Limits(floor=0.0, ends=False), WINDOW, sample)
    shown = check.clamped(np.array([1.1, 1.25, 1.29, 1.31, 1.5]))
    assert shown[[0, 3, 4]].tolist() == [1.1, 1.31, 1.5]
    assert shown[1] == shown[2] == pytest.approx(1.2, abs=2e-5)
    stop = check.first_stop(1.5)
    assert stop == check.stop_at(1.25)
    assert str(stop) == "held at t = 1.200 s while it sinks into the floor"
    assert check.stop_at(1.5) is None


def test_mechanics_that_deforms_too_much_goes_on_and_says_so() -> None:
    def sample(times: Times) -> Sample:
        bent = np.where((times > 1.2) & (times < 1.3), 1.4, 1.0)
        return Sample(np.where(times > 1.4, -0.006, 0.0), bent, np.zeros((len(times), 3)))

    check = PlausibilityCheck(Limits(floor=0.0, ends=False), WINDOW, sample)
    times = np.array([1.1, 1.25, 1.29, 1.31])
    assert np.array_equal(check.clamped(times), times)
    stop = check.stop_at(1.25)
    assert str(stop) == "limited in its deformation at t = 1.250 s: it deforms more than such a body can"
    assert check.stop_at(1.31) is None
    first = check.first_stop(1.5)
    assert first is not None
    assert first.limited
    assert 1.2 < first.time < 1.21
    assert str(check.stop_at(1.45)) == "held at t = 1.400 s while it sinks into the floor"


def test_what_is_shown_flat_on_the_floor_goes_on() -> None:
    def sample(times: Times) -> Sample:
        return Sample(np.where(times > 1.4, -0.006, 0.0), np.zeros_like(times), np.zeros((len(times), 3)))

    check = PlausibilityCheck(Limits(floor=0.0, ends=False, flat=True), WINDOW, sample)
    assert check.clamped(np.array([1.45])).tolist() == [1.45]
    assert str(check.stop_at(1.45)) == "limited in its deformation at t = 1.450 s: it sinks into the floor"
