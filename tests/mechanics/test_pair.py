"""Two blocks that meet, in the air and on the floor."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from jaxtyping import Float
from scipy.spatial.transform import Rotation
from soft_block import Block, grid, outside

from odeform.compiling import compiles
from odeform.geometry.solids.overlap import signed_distances
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.mechanics.flat import body_motion, parts_of, start_of, unpacked
from odeform.mechanics.inside import Inside, inside_of
from odeform.mechanics.pair import Pair
from odeform.mechanics.push import Push, no_push
from odeform.mechanics.pushed_batch import PushedBodies
from odeform.mechanics.step import Mechanics, Projectile
from odeform.mechanics.warping import bent
from odeform.surroundings import GRAVITY
from odeform.types import Floats, Mesh

SOFT = 8
STEP = 1e-4  # s
TILTED = Rotation.from_rotvec([0.7, -0.4, 0.2]).as_matrix()


@pytest.fixture(scope="module")
def inside(block: Block) -> Inside:
    points, elements = grid()
    centre = block.masses @ block.points / block.masses.sum()
    return inside_of(Mesh(points - centre, outside(elements, points)), block.body.support.points)


@pytest.fixture(scope="module")
def mechanics(block: Block) -> Mechanics:
    return Mechanics(block.body, ContactParameters(), Projectile(0.02, 0.02), lands=True, free=np.zeros(12))


@pytest.fixture(scope="module")
def both(block: Block) -> Push:
    push = no_push(block.body, SOFT)
    parts = ("modes", "eigenvalues", "points", "rows", "masses", "centres", "guides", "forces")
    return replace(push, **{name: np.concatenate([getattr(push, name)] * 2) for name in parts})


def state(place: tuple[float, float, float], speed: Floats, spin: Floats, turn: Floats = TILTED) -> Floats:
    """A flat state whose mass centre is so far from where it rests."""
    out = start_of(SOFT)
    shift, rotation, _, _, velocity = parts_of(out[None])
    out[shift], out[rotation], out[velocity][:6] = place, turn.ravel(), np.concatenate([speed, spin])
    return out


def thrown(high: float = 1.0) -> Floats:
    """Two blocks that are about to meet, the one at the corner of the other."""
    one = state((-0.075, 0.01, high), np.array([2.0, 0.1, 0.0]), np.array([1.0, 5.0, 2.0]))
    other = state((0.075, 0.0, high + 0.01), np.array([-0.5, 0.0, 0.0]), np.array([0.0, -2.0, 1.0]), TILTED.T)
    return np.concatenate([one, other])


def followed(pair: Pair, start: Floats, step: float, count: int) -> Float[np.ndarray, "times 2 state"]:
    states = [start]
    for index in range(count):
        states.append(pair.advance(index * step, states[-1], step)[0])
    return np.array(states).reshape(count + 1, 2, -1)


def momenta(block: Block, states: Floats) -> tuple[Floats, Floats, Floats]:
    """(T, 3) linear and angular momentum about the origin of both, and their energies (T,)."""
    mass, inertia = block.body.solid.mass, block.body.solid.inertia
    linear, angular, energy = 0.0, 0.0, 0.0
    for each in states.swapaxes(0, 1):
        velocity = each[:, parts_of(each)[-1]]
        shift, rotation, modes = body_motion(each)
        local = np.einsum("tji,tj->ti", rotation, velocity[:, 3:6])
        linear = linear + mass * velocity[:, :3]
        turning = np.einsum("tij,tj->ti", rotation, local @ inertia)
        angular = angular + turning + mass * np.cross(shift, velocity[:, :3])
        stiff = ContactParameters().stiffness * block.body.eigenvalues[:SOFT]
        kinetic = mass * (velocity[:, :3] ** 2).sum(axis=1) + np.einsum("ti,ij,tj->t", local, inertia, local)
        energy = energy + 0.5 * (kinetic + (velocity[:, 6 : 6 + SOFT] ** 2).sum(axis=1) + modes**2 @ stiff)
        energy = energy + mass * GRAVITY * shift[:, 2]
    return np.asarray(linear), np.asarray(angular), np.asarray(energy)


def test_distances_from_a_turned_body_are_those_of_its_surface(block: Block, inside: Inside) -> None:
    points = np.random.default_rng(0).uniform(-0.08, 0.08, (400, 3))
    still, turns = block.body.support.points, np.tile(np.eye(3), (len(block.body.support.points), 1, 1))
    gap, normal, _ = inside.met(points, still, still, turns)
    grid_points, elements = grid()
    centre = block.masses @ block.points / block.masses.sum()
    mesh = Mesh(grid_points - centre, outside(elements, grid_points))
    known = signed_distances(points, mesh)
    close = np.abs(known) < 0.009  # the grid ends a centimetre away
    np.testing.assert_allclose(gap[close], known[close], atol=1e-3)
    moved = points - gap[:, None] * normal
    assert np.abs(signed_distances(moved[close], mesh)).mean() < 5e-4
    turned = Rotation.from_rotvec([0.3, 0.5, -0.2]).as_matrix()
    carried = inside.met(points @ turned.T, still, still @ turned.T, np.tile(turned, (len(still), 1, 1)))
    np.testing.assert_allclose(carried[0], gap, atol=1e-12)
    np.testing.assert_allclose(carried[1], normal @ turned.T, atol=1e-9)


def test_a_sample_of_a_bent_body_is_on_its_surface(block: Block, inside: Inside, both: Push) -> None:
    bending = start_of(SOFT)
    bending[parts_of(bending[None])[2]] = 2e-3
    turning, place = bent(both.points[:1], both.rows[:1], unpacked(bending[None], False))
    moved = np.linalg.norm(place[0].T - block.body.support.points, axis=1)
    assert moved.max() > 2e-3
    gap = inside.met(place[0].T, block.body.support.points, place[0].T, turning.rotations[0])[0]
    assert np.abs(gap).max() < 0.15 * moved.max()


def test_what_the_one_loses_the_other_one_gains(block: Block, mechanics: Mechanics, both: Push, inside: Inside) -> None:
    states = followed(Pair(mechanics, both, inside), thrown(), STEP, 600)
    linear, angular, energy = momenta(block, states)
    times = STEP * np.arange(len(states))
    mass = block.body.solid.mass
    # the falling of both: two steps of first order, extrapolated, are exact for what is constant
    falling = linear[0] - 2.0 * mass * GRAVITY * times[:, None] * [0.0, 0.0, 1.0]
    np.testing.assert_allclose(linear, falling, atol=1e-12)
    speeds = states[..., parts_of(states[:, 0])[-1]][..., 0]
    assert speeds[-1, 0] < speeds[0, 0] - 0.5, "they have met"
    centre = states[:, :, :3].sum(axis=1)
    torque = mass * GRAVITY * np.cumsum(np.cross(centre, [0.0, 0.0, -1.0]), axis=0) * STEP
    np.testing.assert_allclose(angular[1:], angular[0] + torque[:-1], atol=2e-3 * np.abs(angular[0]).max())
    assert np.diff(energy).max() < 1e-4 * energy[0]
    assert energy[-1] < energy[0]


def test_half_the_step_has_less_than_two_thirds_of_the_error(mechanics: Mechanics, both: Push, inside: Inside) -> None:
    pair, start = Pair(mechanics, both, inside), thrown()
    ends = [followed(pair, start, 0.03 / count, count)[-1, :, :3] for count in (300, 600, 1200)]
    coarse, fine = (np.abs(one - other).max() for one, other in itertools.pairwise(ends))
    assert fine < 0.66 * coarse, "of second order, but for the steps in which contacts begin and end"
    assert fine < 1e-5


def test_apart_each_moves_as_it_does_alone(mechanics: Mechanics, both: Push, inside: Inside) -> None:
    start = thrown(0.03).reshape(2, -1)
    start[1, 0] += 5.0
    pair, alone, rows = Pair(mechanics, both, inside), PushedBodies(mechanics, both, 0.0), np.arange(2)
    together = separate = start
    for index in range(60):
        time = 1e-3 * index
        together = pair.advance(time, together.ravel(), 1e-3)[0].reshape(2, -1)
        separate = alone.advance(rows, np.full(2, time), separate, np.full(2, 1e-3))[0]
    np.testing.assert_allclose(together, separate, rtol=1e-8, atol=1e-9 * np.abs(separate).max())
    assert np.abs(together[:, 13 + SOFT + 2]).max() < 0.5, "they have landed: in free fall it were 0.59 m/s"


@pytest.mark.skipif(not compiles(), reason="needs Numba")
def test_compiled_steps_are_those_of_numpy(
    mechanics: Mechanics, both: Push, inside: Inside, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled, reference, states, met = Pair(mechanics, both, inside), Pair(mechanics, both, inside), thrown(0.02), 0.0
    free = states.reshape(2, -1).copy()
    alone, rows = PushedBodies(mechanics, both, 0.0), np.arange(2)
    for index in range(80):
        found = compiled.advance(1e-3 * index, states, 1e-3)
        with monkeypatch.context() as numpy_only:
            numpy_only.setattr("odeform.mechanics.pair.compiles", lambda: False)
            known = reference.advance(1e-3 * index, states, 1e-3)
        for one, other in zip(known, found, strict=True):
            np.testing.assert_allclose(other, one, rtol=1e-8, atol=1e-9 * np.abs(one).max())
        free = states.reshape(2, -1)
        one_by_one = alone.advance(rows, np.full(2, 1e-3 * index), free, np.full(2, 1e-3))[0]
        met = max(met, float(np.abs(one_by_one.ravel() - known[0]).max()))
        states = known[0]
    assert met > 1e-2, "they have met"
