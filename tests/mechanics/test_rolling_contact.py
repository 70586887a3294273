"""The motion of a round body: what the floor may do to it, and that one body and many are computed alike."""

from dataclasses import replace

import numpy as np
import pytest

from odeform.geometry.primitives import octasphere
from odeform.mechanics.floor import GRAVITY
from odeform.mechanics.rolling import field as fields
from odeform.mechanics.rolling.contact import COEFFICIENTS, PLAIN, RollingContact, initial_contact
from odeform.mechanics.rolling.dynamics import STATE, RollingDynamics
from odeform.mechanics.rolling.field import make_field, units_of
from odeform.mechanics.rolling.sensitivities import roll_out_with_sensitivities
from odeform.mechanics.rolling.support import Support, support_of
from odeform.solver.compiled import CompiledField
from odeform.solver.integrate import SolverSettings, integrate
from odeform.solver.solution import Status
from odeform.types import Floats, Ints

AXIS, RADIUS = np.array([0.0, 1.0, 0.0]), 0.1
FINE = SolverSettings("dopri5", tolerance=1e-9, dtype="float64")


@pytest.fixture(scope="module")
def support() -> Support:
    return support_of(octasphere(RADIUS, 5).points, AXIS)


def any_contact(seed: int = 0) -> RollingContact:
    contact = initial_contact(2, seed)
    flat = contact.flat()
    return contact.like(flat + 0.2 * np.random.default_rng(seed).normal(size=flat.shape))


UNITS = units_of(RADIUS)


def state(**given: float) -> Floats:
    names = ("ahead", "height", "angle", "speed", "rising", "spin", "one", "two")
    return np.array([given.get(name, 0.0) for name in names])


def test_the_field_of_one_motion_is_that_of_many(support: Support) -> None:
    contact, rng = any_contact(), np.random.default_rng(1)
    material, states = rng.uniform(-1.0, 1.0, (40, 2)), rng.normal(size=(STATE, 40))
    states[1] = rng.uniform(-0.02, 0.005, 40)
    together = RollingDynamics(contact, support, RADIUS, material).slopes(states)
    alone = [make_field(contact, support, RADIUS, material[i])(0.0, UNITS * states[:, i]) / UNITS for i in range(40)]
    assert np.allclose(together.T, alone, rtol=1e-12, atol=1e-12)
    assert (together[4] > 0.0).any()
    assert (together[4] == -GRAVITY).any()


@pytest.mark.parametrize(
    "settings",
    [SolverSettings(name, tolerance=1e-5, dtype="float64") for name in ("bosh3", "dopri5")],
    ids=str,
)
def test_compiled_motions_are_those_of_numpy(
    support: Support, settings: SolverSettings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Through flight, landings on corners, sliding and rolling.

    Both round differently, and landings on corners amplify that: by no more than what NumPy makes of a start that
    differs in the twelfth digit.
    """
    begin, material = state(height=0.05, speed=1.5, rising=0.5, spin=-5.0), np.array([0.3, -0.6])
    times = np.linspace(0.0, 0.5, 200)

    def moved(factor: float = 1.0) -> Floats:
        field = make_field(any_contact(), support, RADIUS, material)
        assert isinstance(field, CompiledField) == fields.compiles()
        return integrate(field, factor * UNITS * begin, settings, 0.5).sample(times)

    found = moved()
    monkeypatch.setattr(fields, "compiles", lambda: False)
    expected, differing = moved(), moved(1.0 + 1e-12)
    landing = int((expected[:, 1] < 0.0).argmax())
    assert 0 < landing < len(times) // 2
    np.testing.assert_allclose(found[:landing], expected[:landing], rtol=1e-13, atol=1e-14)
    assert np.abs(found - expected).max() < np.abs(differing - expected).max() < 1e-5


def check_derivatives(contact: RollingContact, support: Support, chosen: Ints, accuracy: float = 1e-4) -> Floats:
    """Those of positions by the chosen numbers of a contact, (T, M, 3, F), against differences."""
    rng, count, flat = np.random.default_rng(1), 30, contact.flat()
    material, states = rng.uniform(-1.0, 1.0, (count, 2)), rng.normal(size=(STATE, count))
    states[1], states[2] = rng.uniform(-0.02, 0.005, count), rng.uniform(-1.0, 1.0, count)
    roll, dynamics = (4, 10, 1e-3), RollingDynamics(contact, support, RADIUS, material)
    rolled, changes = roll_out_with_sensitivities(dynamics, chosen, states, *roll)
    assert np.array_equal(rolled, dynamics.roll_out(states, *roll))
    for index, number in enumerate(chosen):
        step = 1e-6 * (np.arange(len(flat)) == number)
        up, down = (
            RollingDynamics(contact.like(flat + sign * step), support, RADIUS, material).roll_out(states, *roll)
            for sign in (1.0, -1.0)
        )
        expected = ((up - down)[:, :3] / 2e-6).swapaxes(1, 2)
        assert np.allclose(
            changes[..., index], expected, rtol=10.0 * accuracy, atol=accuracy * np.abs(expected).max() + 1e-8
        )
    return changes


def test_derivatives_by_contact_parameters_are_those_of_differences(support: Support) -> None:
    contact, rng = any_contact(), np.random.default_rng(1)
    size, count = contact.terms.size, len(contact.flat())
    changes = check_derivatives(contact, support, np.arange(0, size, 3))
    assert np.abs(changes).max(axis=(0, 1, 2)).min() > 0.0
    check_derivatives(contact, support, size + rng.permutation(count - size)[:25])


@pytest.mark.parametrize(("power", "corners"), [(2.6, 2.0), (-4.0, -8.0)])
def test_numbers_beyond_their_bounds_change_nothing(support: Support, power: float, corners: float) -> None:
    """The power of the depth at both ends; of the corners, what makes a body higher, not what turns it."""
    contact, names = any_contact(), [*COEFFICIENTS, *PLAIN]
    terms = contact.terms.copy()
    width = terms.shape[1]
    chosen = width * np.array([names.index("power"), names.index("corners")])
    terms[names.index("power")], terms[names.index("corners")] = 0.0, 0.0
    terms.flat[chosen] = power, corners
    changes = check_derivatives(replace(contact, terms=terms), support, chosen, accuracy=2e-3)
    assert not changes[..., 0].any()
    assert changes[..., 1].any()


def test_flight_is_free_fall(support: Support) -> None:
    field = make_field(any_contact(), support, RADIUS, np.array([0.5, -0.5]))
    begin = state(height=1.0, speed=2.0, rising=1.0, spin=3.0)
    found = integrate(field, UNITS * begin, FINE, 0.4).sample(np.array([0.4]))[0] / UNITS
    expected = [0.8, 1.0 + 0.4 - 0.5 * GRAVITY * 0.16, 1.2, 2.0, 1.0 - 0.4 * GRAVITY, 3.0]
    assert np.allclose(found[:6], expected, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_the_floor_gives_no_energy_to_a_round_body(seed: int) -> None:
    flat = Support(np.zeros(3), np.zeros(3))
    contact = any_contact(seed)
    contact = replace(contact, settled=np.zeros_like(contact.settled), last=0.0 * contact.last)
    material = np.array([0.2, 0.7])
    logs = contact.coefficients(material[None])
    inertia = float(np.exp(logs["inertia"][0])) * RADIUS**2
    lever = RADIUS * (1.0 + 0.1 * float(logs["radius"][0]))
    begin = state(height=0.1, speed=1.0, spin=-5.0)
    times = np.linspace(0.0, 1.5, 600)
    y = integrate(make_field(contact, flat, RADIUS, material), UNITS * begin, FINE, 1.5).sample(times) / UNITS
    energy = GRAVITY * y[:, 1] + 0.5 * (y[:, 3] ** 2 + y[:, 4] ** 2 + inertia * y[:, 5] ** 2)
    away = y[:, 1] > 1e-3 * float(logs["height"][0])  # elsewhere, some is in the spring of the contact
    assert away.sum() > 100
    assert (np.diff(energy[away]) <= 1e-5).all()
    assert abs(y[-1, 3] - lever * y[-1, 5]) < 0.05  # in the end it rolls


def test_a_polygon_stands_highest_on_its_corners() -> None:
    angles = 2.0 * np.pi * np.arange(12) / 12
    points = np.stack([np.sin(angles), np.zeros(12), np.cos(angles)], axis=1)
    support = support_of(points, AXIS)
    heights, slopes = support.at(np.array([0.0, np.pi / 12, np.pi / 6, 5.0 * np.pi / 6]))
    assert heights[[0, 2, 3]] == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)
    # the elastic wall rounds the corners: on two of them it stands higher, by 0.2 % of the radius times log 2
    assert heights[1] == pytest.approx(np.cos(np.pi / 12) - 1.0 + 2e-3 * np.log(2.0), abs=2e-5)
    assert slopes[[0, 2]] == pytest.approx([0.0, 0.0], abs=1e-6)


def test_slopes_of_the_support_are_those_of_its_heights(support: Support) -> None:
    angles = np.random.default_rng(0).uniform(-20.0, 20.0, 200)
    ahead, behind = (support.at(angles + sign * 1e-3)[0] for sign in (1.0, -1.0))
    assert np.allclose((ahead - behind) / 2e-3, support.at(angles)[1], atol=2e-4)


def test_the_support_is_found_at_the_ends_of_its_table(support: Support) -> None:
    """A remainder of a tiny negative angle is rounded to a whole turn."""
    for angle in (0.0, -1e-20, 2.0 * np.pi, -2.0 * np.pi, 200.0 * np.pi):
        heights, slopes = support.at(np.array([angle]))
        assert np.allclose([heights[0], slopes[0]], [support.heights[0], support.slopes[0]], atol=1e-12)
        assert np.isfinite(support.bends(np.array([angle]))).all()


def test_contact_parameters_go_forth_and_back() -> None:
    contact = any_contact(3)
    again = contact.like(contact.flat())
    assert all(np.array_equal(contact.arrays()[name], array) for name, array in again.arrays().items())


def test_damaged_contact_parameters_are_refused() -> None:
    arrays = any_contact().arrays()
    assert np.array_equal(RollingContact.from_arrays(arrays, 2).flat(), any_contact().flat())
    with pytest.raises(ValueError, match=r"law.bias: expected a finite array of shape \(16,\)"):
        RollingContact.from_arrays({**arrays, "law.bias": np.full(16, np.nan)}, 2)
    with pytest.raises(ValueError, match=r"law\.terms"):
        RollingContact.from_arrays(arrays, 3)
    with pytest.raises(KeyError):
        RollingContact.from_arrays({}, 2)


@pytest.mark.parametrize("entry", range(1, 6))
def test_a_state_that_is_not_finite_has_no_slope(support: Support, entry: int) -> None:
    lost = state(height=1.0)
    lost[entry] = np.inf
    field = make_field(any_contact(), support, RADIUS, np.array([0.5, -0.5]))
    assert np.isnan(np.asarray(field(0.0, lost))).all()


@pytest.mark.parametrize("height", [-1e300, float("-inf"), float("nan")])
def test_a_state_that_is_lost_ends_the_integration_with_a_status(support: Support, height: float) -> None:
    field = make_field(any_contact(), support, RADIUS, np.array([0.5, -0.5]))
    with np.errstate(all="ignore"):
        found = integrate(field, state(height=height, rising=-1e200, spin=1e300), FINE, 0.1)
    assert found.status is not Status.OK
