"""Bodies that come to rest on the floor without a motion."""

import numpy as np
import pytest

from odeform.mechanics.elasticity import elastic_forces, tangent_stiffness
from odeform.mechanics.standing import lying, sag, standing
from odeform.simulation.objects.catalog import get_object

PILLOW = get_object("pillow")
MATERIAL = PILLOW.material.young, PILLOW.material.poisson


def test_elastic_forces_have_the_tangent_as_their_slope() -> None:
    shift = 1e-6 * np.random.default_rng(0).normal(size=PILLOW.points.shape)
    moved = [elastic_forces(PILLOW.points, PILLOW.elements, PILLOW.settled + s, *MATERIAL) for s in (-shift, shift)]
    stiffness = tangent_stiffness(PILLOW.points, PILLOW.elements, PILLOW.settled, *MATERIAL)
    expected = -2.0 * (stiffness @ shift.ravel())
    assert (moved[1] - moved[0]).ravel() == pytest.approx(expected, abs=1e-3 * np.abs(expected).max())


def test_a_body_rests_where_the_simulator_leaves_it() -> None:
    settled, rests = standing(PILLOW.points, PILLOW.elements, PILLOW.masses, *MATERIAL)
    assert rests
    assert np.ptp(settled[:, 2]) == pytest.approx(np.ptp(PILLOW.settled[:, 2]), abs=1e-3)
    assert settled[:, 2].min() == pytest.approx(0.0, abs=2e-4)


def test_a_body_sags_in_proportion_to_weight_over_stiffness() -> None:
    young, poisson = MATERIAL
    given = PILLOW.points, PILLOW.elements
    once = sag(*given, PILLOW.masses, young, poisson)
    assert 0.001 < once < 0.2
    assert sag(*given, 3.0 * PILLOW.masses, 3.0 * young, poisson) == pytest.approx(once, rel=0.05)
    assert sag(*given, PILLOW.masses, 0.5 * young, poisson) == pytest.approx(2.0 * once, rel=0.1)


def test_a_box_on_its_edge_falls_onto_a_side() -> None:
    box = np.array(list(np.ndindex(2, 2, 2))) * [1.0, 2.0, 0.3]
    tilt = np.radians(30.0)
    turn = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
    lain = (box @ turn.T) @ lying(box @ turn.T, np.ones(8)).T
    assert np.ptp(lain[:, 2]) == pytest.approx(0.3)
