"""Reduced mechanics of bodies that fly, land on any side, and are kicked."""

from dataclasses import replace

import numpy as np
import pytest
from same_steps import assert_same_steps
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from soft_block import SIZE, Block

from odeform.compiling import compiles
from odeform.geometry.contact import SurfacePoint
from odeform.loads.situation import Flight, Pulse, Situation, pulse_strength
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.mechanics.flat import body_motion, parts_of
from odeform.mechanics.pushed import PushedBody
from odeform.mechanics.step import Mechanics, Projectile
from odeform.models.modal.loaded import Beginning, LoadedBody
from odeform.solver.integrate import SolverSettings, integrate
from odeform.surroundings import GRAVITY
from odeform.types import Floats

PARAMETERS, SPHERE = ContactParameters(), Projectile(0.02, 0.02)
FINE = SolverSettings("limex", tolerance=1e-6, dtype="float64")
TILTED = Rotation.from_rotvec([0.7, -0.4, 0.2]).as_matrix()
SIDE = np.array([0.5 * SIZE[0], 0.0, 0.0])  # from the mass centre


def flier(block: Block, free: Floats | None = None) -> LoadedBody:
    anchor = np.array([0.0, 0.0, block.body.solid.height])
    mechanics = Mechanics(block.body, PARAMETERS, SPHERE, lands=True, free=np.zeros(12) if free is None else free)
    return LoadedBody(mechanics, 8, anchor, np.eye(3))


def kick(block: Block, force: Floats, duration: float = 0.01) -> Situation:
    point = SIDE + np.array([0.0, 0.0, block.body.solid.height])
    return Situation(pulse=Pulse(SurfacePoint(point, np.eye(3)[0], 0, np.eye(3)[0]), force, duration, 0.015))


def solved(body: LoadedBody, begun: Beginning, times: Floats, settings: SolverSettings = FINE) -> Floats:
    field = PushedBody(body.mechanics, begun.push, begun.pulse)
    return integrate(field, begun.start[0], settings, float(times[-1])).sample(times)


def test_a_body_falls_as_a_point_does(block: Block) -> None:
    times, speed = np.linspace(0.0, 0.2, 9), np.array([0.4, -0.3, 1.0])
    body = flier(block)
    states = solved(body, body.begin([Situation(Flight(0.5, TILTED, speed))]), times)
    shift, rotation, modes = body_motion(states)
    expected = shift[0] + np.outer(times, speed) - np.outer(0.5 * GRAVITY * times**2, [0, 0, 1])
    np.testing.assert_allclose(shift, expected, atol=1e-9)
    np.testing.assert_allclose(rotation, np.broadcast_to(TILTED, rotation.shape), atol=1e-9)
    assert np.abs(modes).max() < 1e-12


def test_its_lowest_point_begins_at_the_height(block: Block) -> None:
    body = flier(block)
    (shift, *_) = body_motion(body.begin([Situation(Flight(0.3, TILTED))]).start)
    corners = block.points - [0.0, 0.0, block.body.solid.height]
    lowest = (corners @ TILTED[2]).min() + shift[0, 2] + block.body.solid.height
    assert lowest == pytest.approx(0.3, abs=1e-12)


def test_a_tumbling_body_turns_as_euler_says(block: Block) -> None:
    """Against an integration of its own, which knows no modes and no contacts."""
    inertia, spin, times = block.body.solid.inertia, np.array([3.0, -8.0, 5.0]), np.linspace(0.0, 0.25, 6)

    def slope(_: float, z: Floats) -> Floats:
        turn, local = Rotation.from_quat(z[:4]).as_matrix(), z[4:]
        whole = Rotation.from_quat(z[:4])
        rate = np.array([*(turn @ local), 0.0])
        by = 0.5 * (
            Rotation.from_quat(whole.as_quat()).as_quat()[3] * rate[:3] + np.cross(rate[:3], whole.as_quat()[:3])
        )
        scalar = -0.5 * rate[:3] @ whole.as_quat()[:3]
        return np.concatenate([by, [scalar], np.linalg.solve(inertia, -np.cross(local, inertia @ local))])

    start = np.concatenate([Rotation.from_matrix(TILTED).as_quat(), TILTED.T @ spin])
    expected = solve_ivp(slope, (0.0, times[-1]), start, t_eval=times, rtol=1e-11, atol=1e-12).y[:4].T
    body = flier(block)
    states = solved(body, body.begin([Situation(Flight(1.0, TILTED, spin=spin))]), times)
    apart = Rotation.from_matrix(body_motion(states)[1]) * Rotation.from_quat(expected).inv()
    assert apart.magnitude().max() < 2e-4


def test_a_body_without_stress_does_not_ring_in_the_air(block: Block) -> None:
    free = np.zeros(12)
    free[:3] = [2e-4, -1e-4, 5e-5]
    body, times = flier(block, free), np.linspace(0.0, 0.1, 5)
    states = solved(body, body.begin([Situation(Flight(0.5))]), times)
    modes = body_motion(states)[2]
    np.testing.assert_allclose(modes, np.broadcast_to(free[:8], modes.shape), atol=1e-12)
    bent = flier(block)  # the same amplitudes are a deformation to this one
    begun = body.begin([Situation(Flight(0.5))])
    assert np.abs(body_motion(solved(bent, begun, times))[2] - free[:8]).max() > 1e-4


def test_a_landing_loses_energy_and_comes_to_rest(block: Block) -> None:
    body, times = flier(block), np.linspace(0.0, 1.5, 601)
    states = solved(
        body,
        body.begin([Situation(Flight(0.1, TILTED))]),
        times,
        SolverSettings("limex", tolerance=1e-5, dtype="float64"),
    )
    velocity = states[:, parts_of(states)[-1]]
    inertia, mass = block.body.solid.inertia, block.body.solid.mass
    shift, rotation, modes = body_motion(states)
    local = np.einsum("tji,tj->ti", rotation, velocity[:, 3:6])
    kinetic = mass * (velocity[:, :3] ** 2).sum(axis=1) + np.einsum("ti,ij,tj->t", local, inertia, local)
    stiff = PARAMETERS.stiffness * block.body.eigenvalues[:8]
    energy = 0.5 * (kinetic + (velocity[:, 6:14] ** 2).sum(axis=1) + modes**2 @ stiff) + mass * GRAVITY * shift[:, 2]
    assert energy.max() < energy[0] + 1e-6 * abs(energy[0])
    assert np.abs(velocity[-1, :6]).max() < 0.01
    assert shift[-1, 2] < 0.0 + 0.5 * (SIZE[0] - SIZE[2]), "it lies on one of its sides"


def test_the_floor_does_not_act_before_contact(block: Block) -> None:
    """The damper of a body that stands reaches as far as it falls in its time: a centimetre at landing speed."""
    fall = Situation(Flight(0.02, velocity=np.array([0.0, 0.0, -3.0])))
    body = flier(block)
    standing = replace(body, mechanics=replace(body.mechanics, lands=False))
    times, end = np.linspace(0.0, 0.004, 9), {}
    for name, one in (("lands", body), ("stands", standing)):
        states = solved(one, body.begin([fall]), times)
        end[name] = states[-1, parts_of(states)[-1]][2]
    assert end["lands"] == pytest.approx(-3.0 - GRAVITY * 0.004, abs=1e-9)
    assert end["stands"] > -2.9


@pytest.mark.parametrize("turn", [np.eye(3), TILTED], ids=["as it lies", "tilted"])
def test_a_pulse_gives_its_impulse_and_its_torque(block: Block, turn: Floats) -> None:
    force, duration = np.array([-4.0, 1.0, 6.0]), 0.01
    body = flier(block)
    begun = body.begin([kick(block, force, duration)])
    begun.start[0, 2] += 1.0  # in the air, where nothing else acts
    begun.start[0, parts_of(begun.start)[1]] = turn.ravel()
    states = solved(body, begun, np.array([0.0, 2.0 * duration]))
    velocity, inertia = states[-1, parts_of(states)[-1]], block.body.solid.inertia
    impulse, mass = 0.5 * duration * force, block.body.solid.mass
    np.testing.assert_allclose(mass * velocity[:3], impulse - [0.0, 0.0, 2.0 * duration * mass * GRAVITY], atol=1e-4)
    patch = begun.push.patch
    assert patch is not None
    assert np.linalg.norm(patch.points[0] - SIDE) < 0.01, "it is where it was aimed"
    now = body_motion(states)[1][-1]
    momentum = now @ inertia @ now.T @ velocity[3:6]
    np.testing.assert_allclose(momentum, np.cross(turn @ patch.points[0], impulse), rtol=0.05, atol=1e-5)


def test_a_pulse_begins_and_ends_with_nothing() -> None:
    strength = pulse_strength(np.array([-1.0, 0.0, 0.005, 0.01, 3.0]), 0.01)
    np.testing.assert_allclose(strength, [0.0, 0.0, 1.0, 0.0, 0.0], atol=1e-15)


@pytest.mark.skipif(not compiles(), reason="needs Numba")
@pytest.mark.parametrize("kicked", [True, False])
def test_compiled_steps_are_those_of_numpy(block: Block, kicked: bool) -> None:
    body, spin = flier(block), np.array([20.0, -30.0, 5.0])
    flight = Situation(Flight(0.003, TILTED, np.array([0.5, 0.0, -2.0]), spin))
    situations = [kick(block, np.array(f)) for f in ([-9.0, 2.0, 3.0], [-2.0, 0.0, -7.0])] if kicked else [flight] * 2
    begun = body.begin(situations)
    states, _ = assert_same_steps(body.mechanics, begun.push, begun.start, 40, begun.push)
    assert np.abs(states[:, parts_of(states)[2]]).max() > 1e-5, "they have been deformed"


def test_steps_are_of_second_order_under_a_pulse(block: Block) -> None:
    body = flier(block)
    begun, end = body.begin([kick(block, np.array([-6.0, 2.0, 4.0]))]), np.array([0.0, 0.016])
    begun.start[0, 2] += 1.0
    ends = [
        solved(body, begun, end, SolverSettings("limex", step=step, dtype="float64"))[-1]
        for step in (8e-4, 4e-4, 2e-4, 2.5e-5)
    ]
    errors = [np.abs(one[:12] - ends[-1][:12]).max() for one in ends[:-1]]
    assert 3.0 < errors[0] / errors[1] < 5.5
    assert 3.0 < errors[1] / errors[2] < 5.5


def test_a_step_does_not_pass_over_a_pulse(block: Block) -> None:
    """From rest there is nothing that would tell a long step of it."""
    body, end = flier(block), np.array([0.0, 0.05])
    begun = body.begin([kick(block, np.array([0.0, 0.0, 30.0]))])
    coarse, fine = (
        solved(body, begun, end, SolverSettings("limex", tolerance=t, dtype="float64"))[-1, 2] for t in (1e-2, 1e-6)
    )
    assert fine > 0.005
    assert coarse == pytest.approx(fine, rel=0.2)
