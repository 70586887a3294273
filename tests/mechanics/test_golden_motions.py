"""How each bundled object moves under one push, with contact parameters given here: to a thousandth.

A hundredth more or less of friction, stiffness or the projectile's push changes several of these numbers by more. Where
physics is changed on purpose, `python tests/mechanics/test_golden_motions.py` prints them anew.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from odeform.geometry.primitives import octasphere
from odeform.mechanics.body import ReducedBody, reduce_body, solid_of
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.mechanics.elasticity import elastic_modes, tangent_stiffness
from odeform.mechanics.motion import push_body
from odeform.mechanics.push import make_push
from odeform.mechanics.rolling.contact import initial_contact
from odeform.mechanics.rolling.dynamics import RollingDynamics
from odeform.mechanics.rolling.support import support_of
from odeform.mechanics.step import Mechanics, Projectile
from odeform.mechanics.warping import surface_turns
from odeform.simulation.objects.catalog import OBJECTS, get_object
from odeform.types import Floats

CONTACT = ContactParameters(
    static_penetration=6e-5,
    floor_damping=4e-3,
    floor_friction=0.45,
    floor_regularisation=2.5e3,
    push_stiffness=4.5e5,
    push_damping=6e-3,
    push_friction=0.4,
    push_regularisation=7.5e3,
    stiffness=0.95,
    damping=1.15,
)
SPHERE = Projectile(0.012, 0.020)
MODES, SOFT = 30, 12
GOLDEN = {
    "bottle": [-3.79038, -3.1549, -0.0562234, 68.2329, -82.2078, 0.292747, 1.75551, 10.4968, 10.5385, 17.8862],
    "cat": [-2.97868, -2.77742, 1.79877, 38.6001, -42.4262, 1.84097, 1.88587, 2.55122, 2.79858, 7.88537],
    "dog": [-4.17383, -2.80628, -1.65765, 19.1805, 29.2344, -51.4231, 3.61761, 7.9151, 8.14396, 11.1254],
    "donut": [-2.27935, -1.77768, -0.00371262, 3.07154, -2.63368, 5.20616, 0.138303, 15.5161, 15.5542, 20.2186],
    "chip": [-7.85551, -2.50126, 0.1741, 1.73557, 14.4112, -206.666, 0.0777435, 32.3661, 40.7909, 48.2477],
    "flip-flop": [-1.69533, -1.25898, -0.00133881, 2.54028, 0.0807824, -13.1448, 0.104849, 11.1831, 18.0546, 19.9384],
    "pillow": [-0.291992, -0.174074, -0.207843, -7.7509, 6.42641, -3.26249, 0.382197, 11.1283, 12.1551, 17.5398],
}
"""After 60 ms: shift (3) in mm, rotation vector (3) in mrad, RMS deformation in mm; and the lowest three frequencies in
Hz."""


def reduced(name: str) -> ReducedBody:
    item = get_object(name)
    material, masses, surface = item.material, item.masses, slice(0, item.surface_count)
    shell = material.young, material.poisson, material.thickness
    modes = elastic_modes(
        tangent_stiffness(item.points, item.elements, item.settled, *shell), masses, item.settled, MODES
    )
    points, shapes = item.settled[surface] - masses @ item.settled / masses.sum(), modes.shapes[:, surface]
    turns = surface_turns(points, item.faces, shapes.transpose(1, 2, 0))
    solid = solid_of(item.settled, masses, material.damping)
    return reduce_body(points, item.faces, shapes, turns, modes.eigenvalues, solid, item.weights)


def pushed(name: str) -> Floats:
    """As in `GOLDEN`: down on the side, for 30 ms, with a middling force."""
    body, (weakest, strongest) = reduced(name), get_object(name).forces
    direction = -np.array([0.6, 0.5, 0.62]) / np.linalg.norm([0.6, 0.5, 0.62])
    vertices = body.surface.points[: get_object(name).surface_count]
    contact = vertices[(vertices @ direction).argmin()]
    force = np.sqrt(weakest * strongest) * direction
    push = make_push(body, SOFT, contact[None], (contact - SPHERE.radius * direction)[None], force[None])
    end = push_body(Mechanics(body, CONTACT, SPHERE), push, 0.03, 0.06, 1e-3).states[-1]
    turn = Rotation.from_matrix(end.rotation[0]).as_rotvec()
    bent = np.linalg.norm(end.modes[0]) / np.sqrt(body.solid.mass)
    hertz = np.sqrt(body.eigenvalues[:3]) / (2.0 * np.pi)
    return np.concatenate([1e3 * end.shift[0], 1e3 * turn, [1e3 * bent], hertz])


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in ("donut", "chip") else pytest.mark.slow) for name in OBJECTS]
)
def test_objects_move_as_they_did(name: str) -> None:
    np.testing.assert_allclose(pushed(name), GOLDEN[name], rtol=1e-3, atol=1e-3)


def thrown() -> Floats:
    """(8,) of a ball of two materials, thrown down with spin under initial contact parameters, after 0.35 s."""
    contact = initial_contact(2, 0)
    contact = contact.like(contact.flat() + 0.05 * np.random.default_rng(0).normal(size=contact.flat().shape))
    support = support_of(octasphere(0.1, 5).points, np.array([0.0, 1.0, 0.0]))
    start = np.array([0.0, 0.05, 0.0, 1.0, -1.0, -5.0, 0.0, 0.0])
    return RollingDynamics(contact, support, 0.1, np.array([[0.3, -0.4]])).roll_out(start[:, None], 700, 1, 5e-4)[
        -1, :, 0
    ]


THROWN = [0.155528, -0.00292502, 0.816889, 0.311361, -0.428208, 2.96578, 0.0903846, 0.0466594]
"""Way ahead and up in m, angle in rad, their rates, and memories in cm."""


def test_a_ball_rolls_as_it_did() -> None:
    np.testing.assert_allclose(thrown(), THROWN, rtol=1e-3, atol=1e-5)


if __name__ == "__main__":
    for each in OBJECTS:
        print(f'    "{each}": {[float(f"{number:.6g}") for number in pushed(each)]},')
    print(f"THROWN = {[float(f'{number:.6g}') for number in thrown()]}")
