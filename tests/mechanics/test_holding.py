"""Springs both ways that hold a patch of a body."""

from dataclasses import replace

import numpy as np
import pytest
from same_steps import assert_same_steps
from scipy.spatial.transform import Rotation
from soft_block import SIZE, Block
from test_loads import FINE, TILTED, flier, solved

from odeform.compiling import compiles
from odeform.loads.situation import Clamp, Flight, Situation
from odeform.mechanics.flat import body_motion, parts_of, unpacked
from odeform.mechanics.holding import Hold, grip_of
from odeform.mechanics.rotations import skew
from odeform.models.modal.loaded import Beginning, LoadedBody
from odeform.surroundings import GRAVITY
from odeform.types import Floats, Rotations

SINK, DAMPING = 5e-4, 2e-3


def held(block: Block, place: Floats, turn: Rotations = TILTED, radius: float = 0.03) -> tuple[LoadedBody, Beginning]:
    """A block high in the air, held around the vertex that is nearest to a place, from its middle."""
    body = flier(block)
    known = body.mechanics.body
    vertex = int(((known.surface.points[: len(known.fractions)] - place) ** 2).sum(axis=1).argmin())
    return body, body.begin([Situation(Flight(0.5, turn), clamp=Clamp(vertex, radius, SINK, DAMPING))])


def hold_of(begun: Beginning) -> Hold:
    assert begun.push.hold is not None
    return begun.push.hold


def test_forces_are_the_slopes_of_the_energy_of_the_springs(block: Block) -> None:
    """By differences along each coordinate, in a state that is turned, shifted and bent."""
    _, begun = held(block, 0.5 * np.array(SIZE))
    hold, rng = hold_of(begun), np.random.default_rng(1)
    shift, turn, modes, *_ = parts_of(begun.start)
    state = begun.start.copy()
    state[0, shift] += [0.003, -0.002, 0.001]
    state[0, modes] += 1e-4 * rng.standard_normal(state[0, modes].shape)

    def energy(step: Floats) -> float:
        moved, rotation = state.copy(), state[0, turn].reshape(3, 3)
        moved[0, shift] += rotation @ step[:3]
        moved[0, turn] = (rotation @ Rotation.from_rotvec(step[3:6]).as_matrix()).ravel()
        moved[0, modes] += step[6:]
        held = hold.at(unpacked(moved, False))
        return 0.5 * float((held.stiffness * held.away**2).sum())

    size = 6 + state[0, modes].size
    here = replace(hold, damping=0.0).at(unpacked(state, False)).forces(np.zeros((1, size)))[0]
    small = 1e-6
    slopes = [(energy(small * one) - energy(-small * one)) / (2.0 * small) for one in np.eye(size)]
    # modes turn the surface, and how they do is linearised where it is (modal warping)
    np.testing.assert_allclose(here[:6], -np.array(slopes)[:6], rtol=1e-5, atol=1e-6 * np.abs(here).max())
    np.testing.assert_allclose(here[6:], -np.array(slopes)[6:], rtol=0.1, atol=0.02 * np.abs(here[6:]).max())


def test_a_body_that_is_held_from_above_hangs_lower_by_what_its_springs_give_way(block: Block) -> None:
    body, begun = held(block, np.array([0.0, 0.0, 0.5 * SIZE[2]]), np.eye(3))
    states = solved(body, begun, np.linspace(0.0, 3.0, 4))
    hold, last = hold_of(begun), unpacked(states[-1:], False)
    mass, springs = body.mechanics.body.solid.mass, hold.at(last)
    np.testing.assert_allclose(hold.stiffness.sum(), mass * GRAVITY / SINK, rtol=1e-12)
    pull = (last.rotation @ -(springs.stiffness * springs.away).reshape(1, -1, 3).sum(axis=1)[..., None])[0, :, 0]
    np.testing.assert_allclose(pull, [0.0, 0.0, mass * GRAVITY], atol=1e-3 * mass * GRAVITY)
    assert np.abs(states[-1, parts_of(states)[-1]]).max() < 1e-3, "it has come to rest"
    sunk = hold.places[0, :, 2] - hold.begun(last).places[0, :, 2]
    weights = hold.stiffness[0] / hold.stiffness.sum()
    np.testing.assert_allclose(weights @ sunk, SINK, rtol=1e-2)


@pytest.mark.parametrize("radius", [0.02, 0.05])
def test_a_patch_is_as_stiff_against_turns_as_all_of_the_vertices_that_it_stands_for(
    block: Block, radius: float
) -> None:
    known = flier(block).mechanics.body
    clamp = Clamp(3, radius, SINK, DAMPING)
    grip = grip_of(known, clamp)
    vertices = known.surface.points[: len(known.fractions)]
    every = clamp.stiffness(vertices, known.fractions, known.solid.mass)
    assert len(grip.samples) < np.count_nonzero(every > 1e-3 * every.max())
    assert grip.stiffness.min() >= 0.0

    def tensor(stiffness: Floats, points: Floats) -> Floats:
        rows = np.concatenate([np.broadcast_to(np.eye(3), (len(points), 3, 3)), skew(-points)], axis=2)
        return np.einsum("n,nia,nib->ab", stiffness, rows, rows)

    wanted = tensor(every, vertices)
    np.testing.assert_allclose(tensor(grip.stiffness, vertices[grip.samples]), wanted, atol=1e-3 * np.abs(wanted).max())


def test_what_is_not_held_falls_and_what_is_held_stays(block: Block) -> None:
    body, begun = held(block, np.array([0.5 * SIZE[0], 0.0, 0.0]), np.eye(3))
    times = np.linspace(0.0, 0.1, 3)
    free = Beginning(replace(begun.push, hold=None), begun.start, 0.0, at_rest=False)
    fallen, hanging = (body_motion(solved(body, each, times))[0][-1, 2] for each in (free, begun))
    start = begun.start[0, 2]
    np.testing.assert_allclose(start - fallen, 0.5 * GRAVITY * times[-1] ** 2, rtol=1e-6)
    assert start - hanging < 0.3 * (start - fallen)


def test_no_energy_is_gained(block: Block) -> None:
    body, begun = held(block, np.array([0.5 * SIZE[0], 0.0, 0.5 * SIZE[2]]))
    states = solved(body, begun, np.linspace(0.0, 0.6, 301), FINE)
    solid, velocity = body.mechanics.body.solid, states[:, parts_of(states)[-1]]
    shift, rotation, modes = body_motion(states)
    local = np.einsum("tji,tj->ti", rotation, velocity[:, 3:6])
    kinetic = solid.mass * (velocity[:, :3] ** 2).sum(axis=1) + np.einsum("ti,ij,tj->t", local, solid.inertia, local)
    count = modes.shape[1]
    stiff = body.mechanics.parameters.stiffness * begun.push.eigenvalues[0]
    energy = 0.5 * (kinetic + (velocity[:, 6 : 6 + count] ** 2).sum(axis=1) + modes**2 @ stiff)
    energy += solid.mass * GRAVITY * (shift[:, 2] - shift[0, 2])
    for index, row in enumerate(states):
        springs = hold_of(begun).at(unpacked(row[None], False))
        energy[index] += 0.5 * float((springs.stiffness * springs.away**2).sum())
    swing = 0.5 * kinetic.max()
    assert swing > 1e-4
    assert energy.max() < 0.02 * swing
    assert energy[-1] < -0.1 * swing, "dampers take some of it"


@pytest.mark.skipif(not compiles(), reason="needs Numba")
def test_compiled_steps_are_those_of_numpy(block: Block) -> None:
    body = flier(block)
    clamps = [Clamp(vertex, 0.03, SINK, DAMPING) for vertex in (0, 5)]
    begun = body.begin([Situation(Flight(0.002, TILTED), clamp=clamp) for clamp in clamps])
    free = replace(begun.push, hold=None)
    _, pulled = assert_same_steps(body.mechanics, begun.push, begun.start, 40, free)
    assert pulled > 1e-3, "the springs matter"
