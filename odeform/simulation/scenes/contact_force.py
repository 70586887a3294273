"""Scene `contact-force`: a sphere is driven into a soft body that rests on the floor, and is then gone."""

import zlib
from collections.abc import Callable
from typing import Any

import numpy as np

from odeform.geometry.contact import RADIUS, checked_contact
from odeform.geometry.solids.tetrahedra import inside_out
from odeform.loads.arrow import Arrow
from odeform.schema import OBJECT, Parameter, Parameters, Schema, Window
from odeform.simulation.contact_draws import contact_draws
from odeform.simulation.contacts import MASS, YOUNG, Forces, vector_of
from odeform.simulation.errors import SimulationError
from odeform.simulation.objects.catalog import OBJECTS, get_object
from odeform.simulation.objects.soft_object import SoftObject
from odeform.simulation.physics import GRAVITY
from odeform.simulation.scene import Scene
from odeform.simulation.stepping import Rest, run
from odeform.surroundings import Contacts
from odeform.types import Frames, Mesh, MotionSequence, Points, Times, Vector

__all__ = ["PULSE", "SCENE", "contact_and_force", "drawn_on", "glyphs", "simulate", "simulate_object"]

PULSE = 0.040  # s
STEP = 5e-4  # s, until the projectile has been gone for a while; twice that afterwards
COARSE_FROM = 0.050  # s
UNTIL = 1.0  # s, of a motion on demand
REST = Rest(speed=1e-3, time=0.05)


def _contact(axis: str, low: float, high: float, default: float) -> Parameter:
    return Parameter(
        f"contact_{axis}", "m", low, high, default, description=f"{axis} of the point where the sphere touches the body"
    )


def _force(axis: str, default: float) -> Parameter:
    return Parameter(f"force_{axis}", "N", -25.0, 25.0, default, description=f"{axis} of the force on the sphere")


SCHEMA = Schema(
    scene="contact-force",
    parameters=(
        _contact("x", -0.32, 0.32, 0.038),
        _contact("y", -0.22, 0.22, 0.0),
        _contact("z", 0.0, 0.45, 0.1),
        _force("x", -8.0),
        _force("y", 0.0),
        _force("z", 0.0),
    ),
    window=Window(0.0, 0.19, 100.0),
    objects=OBJECTS,
    notes=(
        "The body rests on the floor. A rigid sphere of 20 mm radius and 20 g, not pulled by gravity, touches it, is "
        "driven by the constant force along its direction for 40 ms, and is then gone.",
        "Contacts lie on the surface of the settled body, forces within 45 degrees of the inward normal.",
    ),
)


def contact_and_force(parameters: Parameters) -> tuple[Vector, Vector]:
    """(3,) m and (3,) N of a parameter set."""
    return vector_of(parameters, "contact"), vector_of(parameters, "force")


def simulate(
    parameters: Parameters,
    rate: float | None = None,
    step: float = STEP,
    report: Callable[[float], None] = lambda _: None,
    until: float | None = None,
) -> MotionSequence:
    """Simulates one motion of one of the seven objects, with frames at `rate` Hz (default: the window's).

    See `simulate_object`.
    """
    # in the data that models are trained on, such a motion has failed
    guard = until is not None and until > SCHEMA.window.stop
    return simulate_object(get_object(parameters[OBJECT]), parameters, rate, step, report, until, guard)


def simulate_object(
    item: SoftObject,
    parameters: Parameters,
    rate: float | None = None,
    step: float = STEP,
    report: Callable[[float], None] = lambda _: None,
    until: float | None = None,
    guard: bool = True,
) -> MotionSequence:
    """One motion of the surface of any soft object to `until` seconds (default: over the scene's window), with frames
    at `rate` Hz. Beyond the window it ends where the body rests.

    `step` in seconds is that of the first 50 ms; later steps are twice as long. `report` gets the fraction done. Frame
    0 is the body settled under the parameters `mass` and `young`, if there are any; the contact is a place on `item`
    and moves with its surface. A contact up to 5 mm off the surface is moved to its nearest point. Where tetrahedra
    turn inside out and stay so, the motion is simulated again with a `guard` that keeps them from it (`GuardedBody`).
    Raises `InputError` for a contact or a force that the scene does not have
    (`odeform.geometry.contact.checked_contact`), and `SimulationError`.
    """
    # here, so that looking at the scene and training on its data need no simulator
    from odeform.simulation.inversion import GuardedBody
    from odeform.simulation.objects.body import SoftBody, contact_of
    from odeform.simulation.projectile import StruckBody, projectile_xml

    window, until = SCHEMA.window, until or SCHEMA.window.stop
    rate = rate or window.rate
    contact, force = contact_and_force(parameters)
    at, centre = checked_contact(item.rest_mesh(), contact, force)
    if (changed := changed_object(item, parameters)) is not item:
        item = changed
        contact = at.moved(item.settled, item.faces)
        at, centre = checked_contact(item.rest_mesh(), contact, force)
    others = projectile_xml(centre, force if force.any() else -at.normal, contact_of(item.material))

    def motion(guarded: bool) -> tuple[Times, Frames]:
        body: SoftBody | GuardedBody = SoftBody(item.points, item.elements, item.material, step, others=others)
        body = GuardedBody(body, item.points, item.elements) if guarded else body
        body.positions = item.settled
        struck = StruckBody(body, force, PULSE)
        times, nodes = run(struck, COARSE_FROM, rate, report=lambda now: report(now / until))
        body.set_timestep(2.0 * step)
        rest = REST if until > window.stop else None
        later, more = run(struck, until, rate, begin=COARSE_FROM, rest=rest, report=lambda now: report(now / until))
        new = later > times[-1] + 0.5 / rate
        return np.concatenate([times, later[new]]), np.concatenate([nodes, more[new]])

    times, nodes = motion(guarded=False)
    solid = item.elements.shape[1] == 4
    if guard and solid and inside_out(nodes[-1], item.elements).any():
        times, nodes = motion(guarded=True)
    if solid and (inverted := int(inside_out(nodes[-1], item.elements).sum())):
        raise SimulationError(f"{inverted} of {len(item.elements)} tetrahedra are inside out at the end")
    vertices = nodes[:, : item.surface_count].astype(np.float32)
    return MotionSequence(times, vertices, item.faces, item.weights, dict(parameters))


def changed_object(item: SoftObject, parameters: Parameters) -> SoftObject:
    """The object with the mass in kg and Young's modulus in kPa that parameters have, if they have any."""
    mass, young = parameters.get(MASS, item.mass), parameters.get(YOUNG, 1e-3 * item.material.young)
    return item.changed(float(mass), 1e3 * float(young))


def sample(name: str, count: int, seed: int) -> list[dict[str, Any]]:
    """`count` parameter sets of the object `name`; see `contact_draws`."""
    item = get_object(name)
    return drawn_on(item, item.forces, count, seed)


def drawn_on(item: SoftObject, forces: Forces, count: int, seed: int) -> list[dict[str, Any]]:
    """`count` contacts and forces on an object, from the weakest to the strongest of `forces`."""
    drawn = contact_draws(item.rest_mesh(), forces, count, [seed, zlib.crc32(item.name.encode())])
    return [
        {
            f"{key}_{axis}": float(x)
            for key, row in (("contact", c), ("force", f))
            for axis, x in zip("xyz", row, strict=True)
        }
        for c, f in drawn
    ]


def glyphs(parameters: Parameters, rest_points: Points) -> tuple[Arrow, ...]:
    """The force on the sphere, as an arrow that ends at its far side; its length is in proportion to the force."""
    if not {p.name for p in SCHEMA.learned} <= set(parameters):
        return ()
    contact, force = contact_and_force(parameters)
    strength, size = float(np.linalg.norm(force)), float(np.ptp(rest_points, axis=0).max())
    if strength == 0.0:
        return ()
    name = parameters.get(OBJECT, OBJECTS[0])
    # what is strong on a body of the user's own is not known here
    strongest = get_object(name).forces[1] if name in OBJECTS else strength
    direction = force / strength
    vector = 0.4 * size * min(strength / strongest, 2.0) * direction
    return (Arrow(contact - 2.0 * RADIUS * direction - vector, vector, f"{strength:.1f} N", 0.0, PULSE),)


def rest_mesh(name: str = OBJECTS[0]) -> Mesh:
    """Returns the settled surface of an object."""
    return get_object(name).rest_mesh()


SCENE = Scene(
    schema=SCHEMA,
    simulate=simulate,
    rest_mesh=rest_mesh,
    step=STEP,
    count=300,
    fixed={"pulse_s": PULSE, "projectile_radius_m": RADIUS, "projectile_mass_kg": 0.020, "gravity_m_s2": GRAVITY},
    gravity=GRAVITY,
    until=UNTIL,
    glyphs=glyphs,
    contacts=Contacts({name: get_object(name).forces for name in OBJECTS}, PULSE, RADIUS),
    sampler=sample,
)
