"""A pushed body: rest, momentum, convergence, and independence of the batch."""

import numpy as np
import pytest
from soft_block import DENSITY, SIZE, Block

from odeform.mechanics.contact_parameters import ContactParameters
from odeform.mechanics.motion import push_body
from odeform.mechanics.push import WIDTHS, Push, make_push
from odeform.mechanics.pushed import PushedBody
from odeform.mechanics.step import Mechanics, Projectile
from odeform.solver.integrate import SolverSettings, integrate
from odeform.solver.solution import Status

CONTACT, NORMAL = np.array([0.5 * SIZE[0], 0.01, 0.01]), np.array([1.0, 0.0, 0.0])
PULSE = 0.02
SPHERE = Projectile(0.012, 0.020)
SOFT = 5  # of the block's 12 modes


def pushed(block: Block, force: np.ndarray, parameters: ContactParameters | None = None) -> PushedBody:
    """A block that is pushed from the right."""
    mechanics = Mechanics(block.body, parameters or ContactParameters(), SPHERE)
    push = make_push(block.body, SOFT, CONTACT[None], CONTACT[None] + 0.012 * NORMAL, force[None])
    return PushedBody(mechanics, push, PULSE)


def test_a_body_that_nobody_pushes_stays_at_rest(block: Block) -> None:
    field = pushed(block, 0.0 * NORMAL)
    solution = integrate(field, field.start, SolverSettings("limex", step=2e-3, dtype="float64"), 0.5)
    assert solution.status is Status.OK
    end = solution.states[-1] - field.start
    assert np.abs(end[:3]).max() < 1e-7
    assert np.abs(end[12 : 12 + field.directions]).max() / np.sqrt(block.body.solid.mass) < 1e-7


def test_steps_converge_to_what_an_explicit_method_finds(block: Block) -> None:
    field, times = pushed(block, -2.0 * NORMAL), np.linspace(0.0, 0.05, 26)

    def shifts(method: str, step: float) -> np.ndarray:
        solution = integrate(field, field.start, SolverSettings(method, step=step, dtype="float64"), 0.05)
        assert solution.status is Status.OK
        return solution.sample(times)[:, :3]

    exact = shifts("rk4", 5e-5)
    assert np.abs(exact[-1]).max() > 1e-3
    # 16 with second order, which contacts that begin within a step do not have
    errors = [np.abs(shifts("limex", step) - exact).max() for step in (4e-3, 1e-3)]
    assert errors[0] > 3.0 * errors[1]
    assert errors[1] < 3e-5


def test_free_flight_is_of_second_order(block: Block) -> None:
    push = pushed(block, 0.0 * NORMAL).push
    field, generator = (
        PushedBody(Mechanics(block.body, ContactParameters(), SPHERE), push, 0.0),
        np.random.default_rng(0),
    )
    start = field.start
    start[2], start[12 : 12 + field.directions] = 1.0, 1e-3 * generator.normal(size=field.directions)
    velocities = start[13 + field.directions :]
    velocities[:6] = [0.5, -0.3, 0.2, 4.0, 7.0, -5.0]

    def end(method: str, step: float) -> np.ndarray:
        solution = integrate(field, start, SolverSettings(method, step=step, dtype="float64"), 0.016)
        return solution.at(0.016)[:17]  # shift, rotation and the softest modes

    exact, steps = end("rk4", 8e-5), [1e-3, 5e-4, 2.5e-4]
    errors = [np.abs(end("limex", step) - exact).max() for step in steps]
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.2)


def test_a_step_may_end_anywhere_in_the_pulse(block: Block) -> None:
    field = pushed(block, -2.0 * NORMAL)
    ends = [
        integrate(field, field.start, SolverSettings("limex", step=step, dtype="float64"), 0.04).at(0.04)[0]
        for step in (1e-3, 0.7e-3)
    ]
    assert ends[0] == pytest.approx(ends[1], rel=0.01)


def test_the_end_of_the_pulse_ends_a_step(block: Block) -> None:
    """A step over it is one up to it, and one that does the rest of the way without the sphere."""
    field, step = pushed(block, -2.0 * NORMAL), 1e-3
    moving = integrate(field, field.start, SolverSettings("limex", step=step, dtype="float64"), 0.9 * PULSE).states[-1]
    for before in (0.2 * step, 0.7 * step):
        first, _, error = field.advance(PULSE - before, moving, before)
        after, slope, rest = field.advance(PULSE, first, step - before)
        whole = field.advance(PULSE - before, moving, step)
        np.testing.assert_allclose(whole[0], after, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(whole[1], slope, rtol=1e-9, atol=1e-9)
        assert whole[2] == pytest.approx(error + rest)
        assert np.abs(after - first).max() > 1e-4


def test_the_push_gives_the_body_its_momentum(block: Block) -> None:
    field = pushed(block, -2.0 * NORMAL, ContactParameters(floor_friction=0.0))
    solution = integrate(field, field.start, SolverSettings("limex", step=5e-4, dtype="float64"), PULSE)
    body, projectile = (solution.states[-1][i] for i in (13 + field.directions, 19 + 2 * field.directions))
    mass = DENSITY * SIZE.prod()
    assert -mass * body + SPHERE.mass * projectile == pytest.approx(2.0 * PULSE, rel=1e-6)


def test_the_sphere_stays_on_its_guide(block: Block) -> None:
    force = np.array([-1.5, 0.8, -0.6])
    field = pushed(block, force)
    solution = integrate(field, field.start, SolverSettings("limex", step=1e-3, dtype="float64"), PULSE)
    *_, centres = field.body_motion(np.stack(solution.states))
    way = centres - centres[0]
    assert np.linalg.norm(way[-1]) > 1e-3
    np.testing.assert_allclose(np.cross(way, force), 0.0, atol=1e-12)


def test_without_a_force_the_guide_points_at_the_contact(block: Block) -> None:
    still, pressed = (pushed(block, force).push for force in (0.0 * NORMAL, np.array([-1.5, 0.8, -0.6])))
    np.testing.assert_allclose(still.guides, -NORMAL[None], atol=1e-12)
    assert still.forces.tolist() == [[0.0]]
    np.testing.assert_allclose(pressed.guides * pressed.forces, [[-1.5, 0.8, -0.6]], atol=1e-12)


def test_directions_of_deformation_vibrate_independently(block: Block) -> None:
    push = pushed(block, -2.0 * NORMAL).push
    (modes,), (squares,) = push.modes, push.eigenvalues
    np.testing.assert_allclose(modes.T @ modes, np.eye(len(squares)), atol=1e-9)
    stiffness = modes.T @ (block.body.eigenvalues[:, None] * modes)
    np.testing.assert_allclose(stiffness, np.diag(squares), atol=1e-9 * squares.max())
    np.testing.assert_array_equal(squares[:SOFT], block.body.eigenvalues[:SOFT])


def test_directions_yield_at_the_contact_as_all_modes_do(block: Block) -> None:
    """Under a steady load on a patch around the contact."""
    push, body = pushed(block, -2.0 * NORMAL).push, block.body
    patch = body.surface.masses * np.exp(-((body.surface.points - CONTACT) ** 2).sum(axis=1) / WIDTHS[0] ** 2)
    load = np.einsum("s,sik->ik", patch / patch.sum(), body.surface.modes)
    all_modes = (load / body.eigenvalues) @ load.T
    mine = load @ push.modes[0]
    np.testing.assert_allclose((mine / push.eigenvalues[0]) @ mine.T, all_modes, rtol=1e-9, atol=1e-12)


def test_motions_do_not_depend_on_the_batch(block: Block) -> None:
    mechanics = Mechanics(block.body, ContactParameters(), SPHERE)
    contacts = np.stack([CONTACT, CONTACT - np.array([0.0, 0.02, 0.0]), CONTACT - np.array([0.0, 0.0, 0.02])])
    forces = np.stack([-2.0 * NORMAL, -3.0 * NORMAL, np.array([-1.0, 0.5, -0.5])])

    def push(rows: slice) -> Push:
        return make_push(block.body, SOFT, contacts[rows], contacts[rows] + 0.012 * NORMAL, forces[rows])

    together = push_body(mechanics, push(slice(0, 3)), PULSE, 0.06, 1e-3)
    for index in range(3):
        row = slice(index, index + 1)
        alone = push_body(mechanics, push(row), PULSE, 0.06, 1e-3)
        np.testing.assert_allclose(alone.shifts[0], together.shifts[index], atol=1e-10)
        np.testing.assert_allclose(alone.amplitudes[0], together.amplitudes[index], atol=1e-10)
        field = PushedBody(mechanics, push(row), PULSE)
        solution = integrate(field, field.start, SolverSettings("limex", step=1e-3, dtype="float64"), 0.06)
        np.testing.assert_allclose(solution.states[60][:3], alone.shifts[0, 60], atol=1e-10)
