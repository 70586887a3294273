"""What a ball on the floor has to do: slide, roll, bounce and rock as mechanics says, where coefficients are known."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from odeform.geometry.primitives import octasphere
from odeform.mechanics.floor import GRAVITY
from odeform.mechanics.rolling.contact import COEFFICIENTS, PLACES, PLAIN, RollingContact, initial_contact
from odeform.mechanics.rolling.dynamics import RollingDynamics, limited
from odeform.mechanics.rolling.field import make_field, units_of
from odeform.mechanics.rolling.support import Support, support_of
from odeform.solver.integrate import SolverSettings, integrate
from odeform.solver.solution import Status
from odeform.types import Floats

RADIUS = 0.1
UNITS = units_of(RADIUS)
ROUND = Support(np.zeros(5), np.zeros(5))
FINE = SolverSettings("dopri5", tolerance=1e-10, dtype="float64")
NONE = -40.0  # the logarithm of what is negligible
STIFFNESS, POWER = 200.0, 1.3
MATERIAL = np.zeros(1)
DEPTH = 0.01 * (GRAVITY / STIFFNESS) ** (1.0 / POWER)  # m, at rest


def contact_of(**given: float) -> RollingContact:
    """Without damping, friction and resistance unless given, and without its network: logarithms of coefficients."""
    start = initial_contact(1, 0)
    plain = {"damping": NONE, "friction": NONE, "rolling": NONE, "damping_power": NONE, "regularisation": np.log(0.005)}
    values = {**COEFFICIENTS, **PLAIN, "height": 0.0, **plain, "stiffness": np.log(STIFFNESS), "power": np.log(POWER)}
    values |= given
    terms = np.zeros_like(start.terms)
    terms[:, 0] = [values[name] for name in [*COEFFICIENTS, *PLAIN]]
    return replace(start, terms=terms, last=np.zeros_like(start.last))


def moved(contact: RollingContact, times: Any, support: Support = ROUND, **given: float) -> Floats:
    """(T, 8) states, from one where all but what is given is zero."""
    names = ("ahead", "height", "angle", "speed", "rising", "spin", "one", "two")
    start = UNITS * np.array([given.get(name, 0.0) for name in names])
    times = np.asarray(times, dtype=float)
    solution = integrate(make_field(contact, support, RADIUS, MATERIAL), start, FINE, float(times[-1]))
    assert solution.status is Status.OK
    return solution.sample(times) / UNITS


@pytest.mark.parametrize(("inertia", "kept"), [(2 / 5, 5 / 7), (2 / 3, 3 / 5)], ids=["solid", "hollow"])
def test_a_sliding_ball_keeps_its_part_of_the_speed_once_it_rolls(inertia: float, kept: float) -> None:
    friction, speed = 0.3, 2.0
    contact = contact_of(friction=np.log(friction), inertia=np.log(inertia))
    rolls = speed * (1.0 - kept) / (friction * GRAVITY)
    y = moved(contact, [0.5 * rolls, 1.5 * rolls, 3.0 * rolls], height=-DEPTH, speed=speed)
    assert y[0, 3] == pytest.approx(speed - 0.5 * friction * GRAVITY * rolls, rel=1e-3)
    assert y[0, 5] == pytest.approx(0.5 * friction * GRAVITY * rolls / (inertia * RADIUS), rel=1e-3)
    np.testing.assert_allclose(y[1:, 3], kept * speed, rtol=2e-3)
    np.testing.assert_allclose(RADIUS * y[1:, 5], y[1:, 3], rtol=2e-3)
    np.testing.assert_allclose(y[:, 1], -DEPTH, atol=1e-9)


def test_a_larger_lever_of_friction_makes_a_ball_spin_less() -> None:
    contact = contact_of(friction=np.log(0.3), radius=2.0)
    y = moved(contact, [1.0], height=-DEPTH, speed=1.0)
    assert y[0, 3] == pytest.approx(1.2 * RADIUS * y[0, 5], rel=2e-3)


def test_rolling_is_braked_by_the_offset_of_the_push() -> None:
    """Deceleration g b / (r (1 + inertia)) while it spins fast: the push stands b ahead of the centre."""
    offset, inertia, speed = 1e-3, 0.4, 4.0
    contact = contact_of(friction=np.log(0.5), rolling=np.log(offset), inertia=np.log(inertia))
    y = moved(contact, [0.1, 0.6], height=-DEPTH, speed=speed, spin=speed / RADIUS)
    lost = (y[0, 3] - y[1, 3]) / 0.5
    assert lost == pytest.approx(GRAVITY * offset / (RADIUS * (1.0 + inertia)), rel=1e-3)
    # and backwards
    back = moved(contact, [0.1, 0.6], height=-DEPTH, speed=-speed, spin=-speed / RADIUS)
    np.testing.assert_allclose(back[:, [0, 3, 5]], -y[:, [0, 3, 5]], rtol=1e-9)


def test_slow_rolling_is_braked_by_its_spin() -> None:
    """At a tenth of a radian a second, by tanh(0.1) of the whole brake."""
    offset, inertia, spin = 1e-3, 0.4, 0.1
    contact = contact_of(friction=np.log(0.5), rolling=np.log(offset), inertia=np.log(inertia))
    y = moved(contact, [0.0, 1e-2], height=-DEPTH, speed=spin * RADIUS, spin=spin)
    assert (y[0, 3] - y[1, 3]) / 1e-2 == pytest.approx(
        np.tanh(spin) * GRAVITY * offset / (RADIUS * (1.0 + inertia)), rel=0.05
    )


def test_slow_sliding_is_braked_by_the_tangent_of_its_speed() -> None:
    slow, friction = 0.2, 0.3
    contact = contact_of(friction=np.log(friction), regularisation=np.log(slow))
    y = moved(contact, [0.0, 1e-4], height=-DEPTH, speed=0.15)
    assert (y[0, 3] - y[1, 3]) / 1e-4 == pytest.approx(friction * GRAVITY * np.tanh(0.15 / slow), rel=3e-3)


def test_a_bounce_without_damping_comes_back_as_high() -> None:
    height = 0.05
    period = np.sqrt(2.0 * height / GRAVITY)
    y = moved(contact_of(), np.linspace(0.0, 4.0 * period, 4001), height=height, speed=0.5, spin=3.0)
    energy = GRAVITY * y[:, 1] + 0.5 * y[:, 4] ** 2
    flying = y[:, 1] > 0.0
    np.testing.assert_allclose(energy[flying], GRAVITY * height, rtol=1e-4)
    assert (y[:, 4] > 0.5).any()
    np.testing.assert_allclose(y[:, [3, 5]], [[0.5, 3.0]] * len(y), rtol=2e-3)
    # deepest where the spring holds all of its energy
    lowest = y[:, 1].min()
    spring = STIFFNESS * (-100.0 * lowest) ** (POWER + 1.0) / (100.0 * (POWER + 1.0))
    assert spring == pytest.approx(GRAVITY * (height - lowest), rel=1e-3)


@pytest.mark.parametrize("loss", [0.1, 0.3])
def test_a_damped_bounce_loses_what_hunt_and_crossley_say(loss: float) -> None:
    """Force k d^p (1 - c z'): u - ln(1 + c u) / c is the same for the speed down before and, with its sign, after."""
    fast, contact = 2.0, contact_of(stiffness=8.0, power=0.0, damping=np.log(loss))
    y = moved(contact, [0.05], height=1e-6, rising=-fast)[0]
    out = np.sqrt(y[4] ** 2 + 2.0 * GRAVITY * y[1])  # where it left the floor

    def kept(speed: float) -> float:
        return speed - np.log1p(loss * speed) / loss

    assert kept(-out) == pytest.approx(kept(fast), rel=0.05)
    assert out < (1.0 - 0.5 * loss) * fast


def test_damping_grows_with_the_depth() -> None:
    """Force k d^p max(1 - c d^q z', 0), with q the odds of its number."""
    contact = contact_of(damping=np.log(0.5), damping_power=np.log(3.0))  # q = 3 / 4
    field = make_field(contact, ROUND, RADIUS, MATERIAL)
    for depth, rising in ((0.5, 1.0), (2.0, -1.5), (2.0, 3.0)):
        slope = field(0.0, np.array([0.0, -0.01 * depth, 0.0, 0.0, rising, 0.0, 0.0, 0.0]))
        push = STIFFNESS * depth**POWER * max(1.0 - 0.5 * depth**0.75 * rising, 0.0)
        assert slope[4] == pytest.approx(push - GRAVITY)
    assert push == 0.0  # it is drawn off faster than it springs back


def test_memories_of_the_depth_fade_at_their_times() -> None:
    flying = moved(contact_of(), [0.01, 0.02], height=1.0, one=1.0, two=2.0)
    np.testing.assert_allclose(flying[:, 6], np.exp([-0.01 / 0.008, -0.02 / 0.008]), rtol=1e-6)
    np.testing.assert_allclose(flying[:, 7], 2.0 * np.exp([-0.01 / 0.025, -0.02 / 0.025]), rtol=1e-6)
    resting, risen = moved(contact_of(), [0.02, 1.0], height=-DEPTH), 1.0 - np.exp([-0.02 / 0.008, -0.02 / 0.025])
    np.testing.assert_allclose(resting[0, 6:], 100.0 * DEPTH * risen, rtol=1e-5)
    np.testing.assert_allclose(resting[1, 6:], 100.0 * DEPTH, rtol=1e-6)


def test_a_ball_with_corners_that_has_settled_rocks_without_loss() -> None:
    """Energy: of weight, motion, and of the spring, however the ball stands on its corners and on settled places."""
    support = support_of(octasphere(RADIUS, 5).points, np.array([0.0, 1.0, 0.0]))
    contact = contact_of(inertia=np.log(0.4), corners=np.log(0.6))
    settled = np.zeros_like(contact.settled)
    settled[:, 0] = np.random.default_rng(0).normal(size=len(PLACES))  # mm
    contact = replace(contact, settled=settled)
    y = moved(contact, np.linspace(0.0, 0.5, 200), support, height=-DEPTH, angle=0.1, spin=-2.0)
    near = np.exp(-0.5 * ((y[:, 2, None] - PLACES) / 0.1) ** 2)
    corners = 0.6 * support.at(y[:, 2])[0]
    depth = np.maximum(corners + 1e-3 * near @ settled[:, 0] - y[:, 1], 0.0)
    spring = STIFFNESS * (100.0 * depth) ** (POWER + 1.0) / (100.0 * (POWER + 1.0))
    moving = y[:, 4] ** 2 + 0.4 * RADIUS**2 * y[:, 5] ** 2
    energy = GRAVITY * y[:, 1] + 0.5 * moving + spring
    assert np.ptp(y[:, 2]) > 0.5
    assert np.ptp(corners) > 1e-3
    # between entries of the support's table, slopes are only nearly those of the heights
    np.testing.assert_allclose(energy, energy[0], atol=0.01 * np.ptp(moving))


def test_the_material_changes_what_is_learned() -> None:
    """Coefficients are quadratic in it, settled places linear."""
    start = initial_contact(2, 0)
    terms = np.random.default_rng(0).normal(size=start.terms.shape)
    found = replace(start, terms=terms).coefficients(np.array([[0.5, -2.0], [0.0, 0.0]]))
    for name, row in zip([*COEFFICIENTS, *PLAIN], terms, strict=True):
        np.testing.assert_allclose(found[name][0], row @ [1.0, 0.5, -2.0, 0.25, -1.0, 4.0])
        assert found[name][1] == row[0]


def test_steps_of_many_motions_are_of_second_order() -> None:
    contact = contact_of(friction=np.log(0.3), damping=np.log(0.1), regularisation=np.log(0.3))
    start = np.zeros((8, 2))
    start[1], start[3], start[5] = -DEPTH, [1.0, -0.5], [3.0, 8.0]
    dynamics = RollingDynamics(contact, ROUND, RADIUS, np.zeros((2, 1)))
    exact = dynamics.roll_out(start, 512, 1, 0.032 / 512)[-1]
    counts, errors = (16, 32, 64), []
    for count in counts:
        out = dynamics.roll_out(start, count // 2, 2, 0.032 / count)
        assert out.shape == (3, 8, 2)
        np.testing.assert_array_equal(out[0], start)
        errors.append(np.abs(out[-1] - exact).max())
    assert np.polyfit(np.log(1.0 / np.array(counts)), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.2)


def test_rates_are_bounded() -> None:
    state = np.arange(-80.0, 80.0, 20.0)[:, None] * np.array([1.0, 2.0])
    kept = state.copy()
    limited(state)
    np.testing.assert_array_equal(state[3:6], np.clip(kept[3:6], -60.0, 60.0))
    np.testing.assert_array_equal(state[[0, 1, 2, 6, 7]], kept[[0, 1, 2, 6, 7]])
