"""Forces of single contacts, by their formulas."""

import numpy as np
import pytest

from odeform.mechanics.contacts import SLIP, Contacts
from odeform.types import Floats

STIFFNESS, DAMPING, FRICTION, GRIP = 2e3, 3e-3, 0.4, 50.0


def contact(gap: float, axes: Floats | None = None) -> Contacts:
    """A point that moves in three directions, along the normal and across it."""
    jacobian = np.eye(3) if axes is None else axes
    one = np.ones((1, 1))
    return Contacts(
        jacobian[None, None], gap * one, STIFFNESS * one, DAMPING * one, FRICTION * one, GRIP * one, DAMPING * one
    )


def drag(force: float, speed: float) -> float:
    limit = FRICTION * force
    return limit / np.sqrt(speed**2 + (limit / GRIP) ** 2 + SLIP**2)


@pytest.mark.parametrize("gap", [-1e-3, -1e-6])
@pytest.mark.parametrize("velocity", [[0.1, 0.3, -0.4], [-0.2, 0.0, 0.0], [-0.05, 1e-5, 2e-5], [0.5, 1.0, 1.0]])
def test_a_spring_and_a_damper_push_and_friction_drags(gap: float, velocity: list[float]) -> None:
    (found,) = contact(gap).forces(np.array([velocity]))
    push = STIFFNESS * max(-gap - DAMPING * velocity[0], 0.0)
    across = np.array(velocity[1:])
    np.testing.assert_allclose(found[0], push, rtol=1e-12)
    np.testing.assert_allclose(found[1:], -drag(push, float(np.linalg.norm(across))) * across, rtol=1e-12)


def test_forces_act_along_the_axes_of_the_contact() -> None:
    axes = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    local = np.array([-0.1, 0.2, 0.3])
    (turned,), (plain,) = contact(-1e-3, axes).forces((local @ axes)[None]), contact(-1e-3).forces(local[None])
    np.testing.assert_allclose(turned, plain @ axes, rtol=1e-12)


def test_light_loads_drag_in_proportion_to_them() -> None:
    """Far below the load at which grip limits it, slow friction is the load times mu / SLIP."""
    tiny = 1e-9
    (found,) = contact(-tiny / STIFFNESS).forces(np.array([[0.0, 1e-7, 0.0]]))
    assert found[1] == pytest.approx(-FRICTION * tiny / SLIP * 1e-7, rel=1e-5)


@pytest.mark.parametrize("gap", [-1e-3, 1e-3])
def test_steps_take_their_forces_implicitly(gap: float) -> None:
    """Where the velocity at the end is as assumed, the step's impulse is its length times the forces there, once the
    contact has moved on."""
    contacts, velocity = contact(gap), np.array([-0.4, 0.2, -0.1])
    for step in (1e-3, 4e-3):
        matrix, impulse = contacts.resistance(np.broadcast_to(velocity, (1, 1, 3)), np.full((1, 1, 1), step))
        found = impulse[0, 0] - matrix[0, 0] @ velocity
        push = STIFFNESS * max(-gap - (step + DAMPING) * velocity[0], 0.0)
        across = -drag(push, float(np.hypot(0.2, 0.1))) * velocity[1:]
        np.testing.assert_allclose(found, step * np.array([push, *across]), rtol=1e-9, atol=1e-15)
