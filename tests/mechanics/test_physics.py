"""What mechanics has to obey whatever its numbers are: conservation, Coulomb's law of friction, weight."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from soft_block import SIZE, Block

from odeform.mechanics.contact_parameters import ContactParameters
from odeform.mechanics.floor import GRAVITY, stand
from odeform.mechanics.motion import push_body
from odeform.mechanics.push import Push, make_push
from odeform.mechanics.state import State
from odeform.mechanics.step import Mechanics, Projectile, Steps
from odeform.types import Floats, Vector

SPHERE = Projectile(0.010, 0.020)
SIDE = np.array([0.0, 0.5 * SIZE[1], 0.0])  # a vertex in the middle of a long side, at the height of the mass centre
NOTHING = np.zeros(3)


def pushed_at_the_side(block: Block, force: float) -> Push:
    across = np.array([0.0, 1.0, 0.0])
    return make_push(block.body, 5, SIDE[None], (SIDE + SPHERE.radius * across)[None], -force * across[None])


class Free:
    """The block without a projectile, in steps of `step` seconds."""

    def __init__(self, block: Block, parameters: ContactParameters, step: float) -> None:
        self.mechanics, self.push = Mechanics(block.body, parameters, SPHERE), pushed_at_the_side(block, 0.0)
        self.steps, self.step = Steps(self.mechanics, self.push, self.mechanics.preload(self.push)), step

    def state(self, shift: Vector, turn: Vector, speed: Vector, spin: Vector, bent: Floats | None = None) -> State:
        size = self.push.eigenvalues.shape[1]
        amplitudes = np.zeros(size) if bent is None else bent
        velocity = np.concatenate([speed, spin, np.zeros(size)])
        rotation = Rotation.from_rotvec(turn).as_matrix()
        return State(shift[None], rotation[None], amplitudes[None], np.zeros((1, 1)), velocity[None])

    def after(self, state: State, seconds: float) -> State:
        for _ in range(round(seconds / self.step)):
            state = self.steps.advance(state, self.step)[0]
        return state

    @property
    def modal(self) -> tuple[Floats, Floats]:
        """Stiffness (K,) of the directions, and the force (K,) that bends them at rest."""
        stiffness = self.mechanics.parameters.stiffness * self.push.eigenvalues[0]
        return stiffness, self.mechanics.floor.preload @ self.push.modes[0]

    def energy(self, state: State) -> float:
        """Joule, without that in springs of contacts."""
        solid, (speed, spin) = self.mechanics.body.solid, (state.velocity[0, :3], state.velocity[0, 3:6])
        inertia = state.rotation[0] @ solid.inertia @ state.rotation[0].T
        stiff, preload = self.modal
        moving = solid.mass * speed @ speed + spin @ inertia @ spin + (state.velocity[0, 6:] ** 2).sum()
        bent = 0.5 * stiff @ state.modes[0] ** 2 + preload @ state.modes[0]
        return 0.5 * moving + solid.mass * GRAVITY * state.shift[0, 2] + bent


@pytest.mark.parametrize("spin", [[0.3, 12.0, 0.2], [8.0, 0.0, 5.0]])
def test_a_free_rotor_turns_as_euler_says(block: Block, spin: list[float]) -> None:
    """About its middle axis of inertia, which is not stable, and about none."""
    free, start, duration = Free(block, ContactParameters(), 1e-3), np.array(spin), 0.25
    inertia = block.body.solid.inertia
    end = free.after(free.state(np.array([0.0, 0.0, 1.0]), NOTHING, NOTHING, start), duration)
    rotation, found = end.rotation[0], end.velocity[0, 3:6]

    def euler(_: float, z: Floats) -> Floats:
        turn, rate = z[:9].reshape(3, 3), z[9:]
        cross = np.cross(np.eye(3), rate)
        return np.concatenate([(turn @ cross).ravel(), np.linalg.solve(inertia, np.cross(inertia @ rate, rate))])

    exact = solve_ivp(euler, (0.0, duration), np.concatenate([np.eye(3).ravel(), start]), rtol=1e-10, atol=1e-12).y
    np.testing.assert_allclose(rotation, exact[:9, -1].reshape(3, 3), atol=2e-4)
    np.testing.assert_allclose(rotation.T @ found, exact[9:, -1], atol=2e-3)
    momentum = rotation @ inertia @ rotation.T @ found
    np.testing.assert_allclose(momentum, inertia @ start, atol=1e-5 * np.linalg.norm(inertia @ start))
    assert found @ momentum == pytest.approx(start @ inertia @ start, rel=1e-5)


def test_a_thrown_body_falls_freely_and_its_modes_vibrate(block: Block) -> None:
    free, duration = Free(block, ContactParameters(damping=0.0), 4e-4), 0.04
    stiff, preload = free.modal
    bent = 1e-3 * np.random.default_rng(0).normal(size=len(stiff))
    speed = np.array([0.3, -0.2, 1.0])
    start = free.state(np.array([0.0, 0.0, 1.0]), NOTHING, speed, NOTHING, bent)
    end = free.after(start, duration)
    np.testing.assert_allclose(end.shift[0], [0.012, -0.008, 1.0 + 0.04 - 0.5 * GRAVITY * 0.0016], atol=1e-12)
    np.testing.assert_allclose(end.velocity[0, :3], speed - [0.0, 0.0, GRAVITY * duration], atol=1e-12)
    expected = (bent + preload / stiff) * np.cos(np.sqrt(stiff) * duration) - preload / stiff
    np.testing.assert_allclose(end.modes[0, :3], expected[:3], atol=5e-5)
    damped = Free(block, ContactParameters(damping=1.15), 4e-4).after(start, duration)
    ratio = 0.5 * 1.15 * block.body.solid.damping * stiff  # decay of the amplitude, 1/s
    rate = np.sqrt(stiff - ratio**2)
    phase = rate * duration
    swing = (bent + preload / stiff) * np.exp(-ratio * duration) * (np.cos(phase) + ratio / rate * np.sin(phase))
    np.testing.assert_allclose(damped.modes[0, :2], (swing - preload / stiff)[:2], atol=5e-5)


@pytest.mark.parametrize("speed", [NOTHING, np.array([3.0, -2.0, 1.0])])
def test_the_error_of_a_step_in_flight_is_that_of_the_fall(block: Block, speed: Floats) -> None:
    """However fast: two half steps of first order end g h^2 / 4 above a whole one, with the same velocities."""
    free, step = Free(block, ContactParameters(), 1e-3), 1e-3
    stiff, preload = free.modal
    start = free.state(np.array([0.0, 0.0, 1.0]), NOTHING, speed, NOTHING, -preload / stiff)
    assert free.steps.advance(start, step)[1][0] == pytest.approx(0.25 * GRAVITY * step**2, rel=1e-9)


@pytest.mark.parametrize(
    ("speed", "spin"), [([0.0, 0.0, -3.0], NOTHING), ([0.0, 0.0, 0.5], [60.0, 0.0, 0.0]), (NOTHING, [0.0, 60.0, 0.0])]
)
def test_a_step_feels_the_floor_that_is_reached_within_it(block: Block, speed: Floats, spin: Floats) -> None:
    """Also by an edge that turns down."""
    free, step = Free(block, ContactParameters(), 5e-3), 5e-3
    above = 5e-3 if np.any(spin) else 3e-3
    start = free.state(np.array([0.0, 0.0, above]), NOTHING, np.array(speed), np.array(spin))
    falling = speed[2] - GRAVITY * step
    assert free.steps.advance(start, step)[0].velocity[0, 2] > falling + 0.01


@pytest.mark.parametrize("turn", [[0.0, 0.0, 0.0], [0.3, 0.2, 0.0]])
def test_a_bounce_without_damping_keeps_the_energy(block: Block, turn: list[float]) -> None:
    """Also on an edge, where most of it goes into spin."""
    free = Free(
        block, ContactParameters(static_penetration=2e-3, floor_damping=0.0, damping=0.0, floor_friction=0.0), 4e-4
    )
    stiff, preload = free.modal
    start = free.state(
        np.array([0.0, 0.0, 0.03]), np.array(turn), np.array([0.1, 0.2, -0.5]), NOTHING, -preload / stiff
    )
    end = free.after(start, 0.12)
    falling = 0.5 * block.body.solid.mass * 0.25 + block.body.solid.mass * GRAVITY * 0.03
    assert end.velocity[0, 2] > 0.2
    assert abs(free.energy(end) - free.energy(start)) < 2e-3 * falling
    np.testing.assert_allclose(end.velocity[0, :2], [0.1, 0.2], atol=1e-9)  # no friction
    lossy = Free(block, ContactParameters(static_penetration=2e-3, damping=0.0, floor_friction=0.0), 4e-4)
    assert free.energy(lossy.after(start, 0.12)) < free.energy(start) - 0.1 * falling


@pytest.mark.parametrize("friction", [0.3, 0.45])
@pytest.mark.parametrize("azimuth", [0.0, 2.0])
def test_a_sliding_body_stops_after_the_distance_of_coulomb(block: Block, friction: float, azimuth: float) -> None:
    free = Free(block, ContactParameters(floor_friction=friction), 1e-3)
    speed = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    moving = free.after(free.state(NOTHING, NOTHING, speed, NOTHING), 0.1)
    np.testing.assert_allclose(moving.velocity[0, :3], (1.0 - 0.1 * friction * GRAVITY) * speed, atol=2e-3)
    end = free.after(moving, 0.4)
    np.testing.assert_allclose(end.shift[0], speed / (2.0 * friction * GRAVITY), atol=2e-4)
    np.testing.assert_allclose(end.velocity[0], 0.0, atol=1e-4)


@pytest.mark.parametrize("friction", [0.2, 0.3])
def test_a_body_slides_once_it_is_pushed_harder_than_friction_holds(block: Block, friction: float) -> None:
    parameters = ContactParameters(floor_friction=friction, push_friction=0.0)
    mechanics, mass = Mechanics(block.body, parameters, SPHERE), block.body.solid.mass
    limit = friction * mass * GRAVITY

    def speeds(share: float) -> Floats:
        """(T,) m/s under a share of the force that friction can hold."""
        nodes = push_body(mechanics, pushed_at_the_side(block, share * limit), 0.2, 0.2, 1e-3)
        return np.array([-state.velocity[0, 1] for state in nodes.states])

    # slow sliding: so fast that the friction of all that stands on the floor, limited and viscous, holds the force
    low = block.body.support.points[:, 2].min()
    viscous = (
        parameters.floor_regularisation * block.body.support.masses[block.body.support.points[:, 2] < low + 1e-6].sum()
    )
    assert speeds(0.5)[-1] == pytest.approx(0.5 / np.sqrt(0.75) * limit / viscous, rel=0.03)
    assert speeds(0.9)[-1] < 0.01
    gained = speeds(1.2)
    assert gained[-1] - gained[120] == pytest.approx(0.2 * limit / (mass + SPHERE.mass) * 0.08, rel=0.1)


@pytest.mark.parametrize("friction", [0.25, 0.5])
def test_a_sphere_rubs_along_what_it_pushes(block: Block, friction: float) -> None:
    """Pushed at a slant, the side of the body resists along the normal, and across it up to Coulomb's limit."""
    parameters = ContactParameters(floor_friction=0.0, push_friction=friction)
    mechanics = Mechanics(block.body, parameters, SPHERE)
    across = np.array([0.0, 1.0, 0.0])
    force = 2.0 * np.array([np.sin(0.6), -np.cos(0.6), 0.0])
    push = make_push(block.body, 5, SIDE[None], (SIDE + SPHERE.radius * across)[None], force[None])
    pushed = push_body(mechanics, push, 0.0025, 0.0025, 5e-4).states[-1].velocity[0, :2]
    assert pushed[1] < -0.005
    assert -pushed[0] / pushed[1] == pytest.approx(friction, rel=0.07)


@pytest.mark.parametrize("depth", [5e-5, 1e-4])
def test_a_block_sinks_as_far_as_its_springs_give(block: Block, depth: float) -> None:
    floor, support = stand(block.body, ContactParameters(static_penetration=depth)), block.body.support
    weight = block.body.solid.mass * GRAVITY
    assert floor.stiffness.sum() == pytest.approx(4.0 * weight / depth)
    depth = np.maximum(-(support.points[:, 2] + floor.level), 0.0)
    bottom = support.points[:, 2] < support.points[:, 2].min() + 1e-6
    np.testing.assert_allclose(depth[bottom], weight / floor.stiffness[bottom].sum(), rtol=1e-5)
    assert not depth[~bottom].any()
    np.testing.assert_allclose(floor.preload, (floor.stiffness * depth) @ support.rows[2], rtol=1e-6)


def test_springs_balance_a_body_that_leans(block: Block) -> None:
    """Without equal springs on both sides, the floor tilts until weight and torque are balanced."""
    support = block.body.support
    uneven = support.masses * (1.0 + 8.0 * support.points[:, 0])
    body = replace(block.body, support=replace(support, masses=uneven))
    floor = stand(body, ContactParameters())
    force = floor.stiffness * np.maximum(-(support.points[:, 2] + floor.level), 0.0)
    weight = body.solid.mass * GRAVITY
    assert force.sum() == pytest.approx(weight, rel=1e-6)
    np.testing.assert_allclose(force @ support.points[:, :2], 0.0, atol=1e-7 * weight)
    assert np.ptp(floor.level) > 1e-6
