"""A clamped body: formulas of beams, large rotation, nearly incompressible material, energy, order of steps."""

from functools import cache

import numpy as np
import pytest

from odeform.errors import InputError
from odeform.geometry.rigid import rotation_from_vector
from odeform.geometry.solids.block import block
from odeform.mechanics.clamped import ClampedBody, Weight, held_by_ball, held_by_face
from odeform.mechanics.quadratic import QuadraticMesh, Stiffness, quadratic_mesh
from odeform.mechanics.swinging import Loss, SwingingBody, swinging_body

SIDE, LENGTH, YOUNG, DENSITY = 0.03, 0.3, 2e6, 1000.0
AREA, BENDING = SIDE**2, YOUNG * SIDE**4 / 12.0
TIP = np.array([[0.5 * SIDE, 0.5 * SIDE, LENGTH]])


def beam_mesh(length: float = LENGTH, along: int = 12) -> QuadraticMesh:
    return quadratic_mesh(*block(np.zeros(3), np.array([SIDE, SIDE, length]), (2, 2, along)))


def beam(
    poisson: float = 0.3, density: float = DENSITY, gravity: float = 0.1, weight: float = 0.0, young: float = YOUNG
) -> ClampedBody:
    mesh = beam_mesh()
    weights = [Weight(weight, TIP)] if weight else []
    pull = np.array([-gravity, 0.0, 0.0])
    return ClampedBody(Stiffness(mesh, young, poisson), density, held_by_face(mesh, 2, low=True), pull, weights)


def tip_of(body: ClampedBody, moved: np.ndarray) -> np.ndarray:
    return (body.mesh.rows_at(TIP) @ moved)[0]


@cache
def swinging(gravity: float = 2.0) -> tuple[ClampedBody, SwingingBody]:
    body = beam(gravity=gravity)
    return body, swinging_body(body, body.directions())


def test_a_block_is_filled() -> None:
    mesh = beam_mesh()
    assert mesh.volumes.sum() == pytest.approx(AREA * LENGTH)
    assert mesh.masses(DENSITY).sum() == pytest.approx(DENSITY * AREA * LENGTH)


def test_the_tangent_is_the_derivative_of_the_forces() -> None:
    mesh = beam_mesh(along=2)
    rng, material = np.random.default_rng(0), Stiffness(mesh, 1.0, 0.4)
    moved, step = 0.003 * rng.standard_normal(mesh.points.shape), rng.standard_normal(mesh.points.shape)
    by_difference = (material.forces(moved + 1e-7 * step) - material.forces(moved - 1e-7 * step)) / 2e-7
    tangent = (material.tangent(moved) @ step.ravel()).reshape(-1, 3)
    assert np.allclose(by_difference, -tangent, atol=1e-5 * np.abs(tangent).max())


def test_turning_costs_nothing() -> None:
    mesh = beam_mesh(along=2)
    turned = mesh.points @ rotation_from_vector(np.array([0.3, -1.0, 2.0])).T - mesh.points
    assert np.abs(Stiffness(mesh, YOUNG, 0.49).forces(turned)).max() < 1e-8 * YOUNG * AREA


@pytest.mark.parametrize("poisson", [0.3, 0.499])
def test_a_beam_sags_as_by_the_formula(poisson: float) -> None:
    body = beam(poisson)
    load, shear = DENSITY * 0.1 * AREA, YOUNG / (2.0 * (1.0 + poisson))
    formula = load * LENGTH**4 / (8.0 * BENDING) + load * LENGTH**2 / (2.0 * 5.0 / 6.0 * shear * AREA)
    # the held face cannot contract sideways, which holds a nearly incompressible beam a little more
    assert tip_of(body, body.static())[0] == pytest.approx(-formula, rel=0.03)


@pytest.mark.parametrize("poisson", [0.3, 0.499])
def test_a_beam_swings_as_by_the_formula(poisson: float) -> None:
    square = beam(poisson).modes(1)[0][0]
    assert np.sqrt(square) == pytest.approx(3.516 * np.sqrt(BENDING / (DENSITY * AREA)) / LENGTH**2, rel=0.02)


def test_a_weight_slows_it_as_by_the_formula() -> None:
    weight = 0.5
    square = beam(weight=weight).modes(1)[0][0]
    moved = weight + 33.0 / 140.0 * DENSITY * AREA * LENGTH
    assert np.sqrt(square) == pytest.approx(np.sqrt(3.0 * BENDING / (moved * LENGTH**3)), rel=0.02)


def test_a_beam_bends_far_as_the_elastica() -> None:
    """A load P at the end with P L^2 = E I: tip 0.3017 L down and 0.0564 L back (Bisshopp and Drucker 1945)."""
    weight = 0.1
    body = beam(density=1e-3, weight=weight, gravity=BENDING / LENGTH**2 / weight)
    down, _, back = tip_of(body, body.static())
    assert down == pytest.approx(-0.3017 * LENGTH, rel=0.03)
    assert back == pytest.approx(-0.0564 * LENGTH, rel=0.06)


def test_held_nodes_stay_and_few_directions_suffice() -> None:
    body, reduced = swinging(gravity=4.0)
    directions = body.directions()
    assert np.all(directions[:, body.held] == 0.0)
    whole = body.static(1.5, body.static())
    few = np.einsum("rni,r->ni", directions, reduced.hanging(1.5)[0])
    assert tip_of(body, whole)[0] < -0.1 * LENGTH
    assert np.abs(few - whole).max() < 0.01 * np.abs(whole).max()


def test_the_load_factor_moves_where_it_hangs() -> None:
    _, reduced = swinging()
    derivative = reduced.hanging(1.0)[1]
    assert np.allclose(
        (reduced.hanging(1.01)[0] - reduced.hanging(0.99)[0]) / 0.02, derivative, atol=1e-3 * np.abs(derivative).max()
    )


@pytest.mark.parametrize("loss", [Loss(viscous=2e-2), Loss(lag=0.3, time=0.03)])
def test_energy_is_lost_and_it_comes_to_rest(loss: Loss) -> None:
    _, reduced = swinging()
    hangs, _ = reduced.hanging()
    swing = reduced.release(6.0, 0.01, loss)
    assert np.abs(swing.amplitudes).max() > 1.5 * np.abs(hangs).max()
    assert np.abs(swing.amplitudes[-50:] - hangs).max() < 0.1 * np.abs(hangs).max()
    if loss.lag == 0.0:
        assert np.all(np.diff(swing.energy) < 1e-9 * np.ptp(swing.energy))


def test_no_energy_is_lost_without_damping() -> None:
    _, reduced = swinging(gravity=0.2)
    swing = reduced.release(1.0, 1e-3, Loss())
    kinetic_and_elastic = np.abs(reduced.load @ swing.amplitudes.T).max()
    assert np.abs(swing.energy).max() < 2e-3 * kinetic_and_elastic


def test_a_lag_stiffens_fast_motion_only() -> None:
    _, reduced = swinging(gravity=0.2)

    def period(loss: Loss) -> float:
        swing = reduced.release(2.0, 2e-3, loss)
        slopes = np.diff(swing.amplitudes[:, 0])
        turns = np.flatnonzero((slopes[:-1] > 0.0) & (slopes[1:] <= 0.0))
        return float(swing.times[turns[-1]] - swing.times[turns[0]]) / (len(turns) - 1)

    # the root of 1.44; some damping, or fast modes turn as well
    assert period(Loss(viscous=1e-3)) == pytest.approx(1.2 * period(Loss(viscous=1e-3, lag=0.44, time=10.0)), rel=0.02)
    assert period(Loss(viscous=1e-3)) == pytest.approx(period(Loss(viscous=1e-3, lag=0.44, time=1e-5)), rel=0.02)


@pytest.mark.parametrize("loss", [Loss(viscous=2e-3), Loss(viscous=2e-3, lag=0.3, time=0.03)])
def test_steps_are_of_second_order(loss: Loss) -> None:
    _, reduced = swinging(gravity=0.5)
    ends = [reduced.release(0.2, step, loss).amplitudes[-1] for step in (2e-3, 1e-3, 5e-4)]
    order = np.log2(np.linalg.norm(ends[0] - ends[1]) / np.linalg.norm(ends[1] - ends[2]))
    assert abs(order - 2.0) < 0.2


def test_stiffness_scales_without_a_new_body() -> None:
    body, reduced = swinging()
    directions = np.einsum("rni,r->ni", body.directions(), reduced.times_as_stiff(1.5).hanging()[0])
    assert tip_of(body, directions) == pytest.approx(
        tip_of(body, body.with_young(1.5 * YOUNG).static()), rel=0.01, abs=1e-5
    )


def test_a_marker_beside_the_body_turns_with_it() -> None:
    mesh = beam_mesh()
    turn = rotation_from_vector(np.array([0.0, 0.01, 0.0])) - np.eye(3)
    places = np.array([[SIDE + 0.006, 0.01, 0.2], [0.01, 0.01, 0.1]])
    assert np.allclose(mesh.rows_at(places) @ (mesh.points @ turn.T), places @ turn.T, atol=1e-9)


def test_clamps_of_nothing_and_of_everything_are_refused() -> None:
    mesh = beam_mesh(along=2)
    material = Stiffness(mesh, YOUNG, 0.3)
    with pytest.raises(InputError, match="region that holds the body"):
        ClampedBody(material, DENSITY, held_by_ball(mesh, np.ones(3), 0.1), np.zeros(3))
    with pytest.raises(InputError, match="leaves a part of the body free"):
        ClampedBody(material, DENSITY, held_by_ball(mesh, np.zeros(3), 9.0), np.zeros(3))


@pytest.mark.parametrize(("young", "poisson"), [(0.0, 0.3), (-1.0, 0.3), (np.inf, 0.3), (1.0, 0.5), (1.0, np.nan)])
def test_materials_that_cannot_be_are_refused(young: float, poisson: float) -> None:
    with pytest.raises(InputError, match="expected a"):
        Stiffness(beam_mesh(along=1), young, poisson)


def test_a_weight_below_zero_is_refused() -> None:
    with pytest.raises(InputError, match="at least 0 kg"):
        Weight(-1.0, TIP)
