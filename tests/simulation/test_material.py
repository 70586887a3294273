from dataclasses import replace

import pytest

from odeform.simulation.material import damping_time, wall_thickness
from odeform.simulation.objects.ball import MATERIAL


def test_wall_has_the_stiffness_asked_for() -> None:
    thickness = wall_thickness(0.6, MATERIAL)
    assert MATERIAL.young * thickness**3 / (12.0 * (1.0 - MATERIAL.poisson**2)) == pytest.approx(0.6)


def test_damping_is_that_of_the_lining_whatever_the_wall() -> None:
    """Stiffness against stretching E h, times the damping time: the same force at the same speed."""
    for bending in (0.3, 3.0):
        thickness = wall_thickness(bending, MATERIAL)
        assert damping_time(thickness, MATERIAL) * MATERIAL.young * thickness == pytest.approx(MATERIAL.viscosity)
    assert damping_time(0.04, MATERIAL) == pytest.approx(0.5 * damping_time(0.02, MATERIAL))
    assert damping_time(0.04, replace(MATERIAL, viscosity=0.0)) == 0.0
