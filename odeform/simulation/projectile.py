"""A rigid sphere on a guide that a constant force drives into a soft body for a while."""

# MuJoCo is a compiled module without type stubs
# pyright: reportAttributeAccessIssue=false

from odeform.geometry.contact import RADIUS
from odeform.simulation.errors import SimulationError
from odeform.simulation.flex import CONTACT_RADIUS, Contact, FlexBody
from odeform.simulation.inversion import GuardedBody
from odeform.types import Floats, Vector

__all__ = ["MASS", "StruckBody", "projectile_xml"]

MASS = 0.020  # kg
SUNK = 0.006  # m; a projectile that overlaps the body by more has passed through its surface


def projectile_xml(centre: Vector, direction: Vector, contact: Contact) -> str:
    """Returns the body of a projectile with its centre at (3,) m, without weight.

    A guide lets it move along `direction` (3,) only, without turning. Free, it would roll off a surface that it does
    not meet head-on, to one side or the other: moving a contact by 1 mm changed the motion of a flip-flop by 67 %.
    """
    # the skin around the flex is part of the radius
    return (
        f'<body name="projectile" pos="{_numbers(centre)}" gravcomp="1">'
        f'<joint type="slide" axis="{_numbers(direction)}"/>'
        f'<geom name="projectile" type="sphere" size="{RADIUS - CONTACT_RADIUS}" mass="{MASS}" {contact.xml}/></body>'
    )


def _numbers(vector: Vector) -> str:
    return " ".join(f"{x:.17g}" for x in vector)


class StruckBody:
    """A flexible body with a projectile, which is gone after the pulse. It is a `odeform.simulation.stepping.Body`."""

    def __init__(self, body: FlexBody | GuardedBody, force: Vector, pulse: float) -> None:
        """`body` has a projectile (`projectile_xml`), which `force` (3,) N drives for `pulse` seconds."""
        self.body, self._pulse = body, pulse
        self._index = body.model.body("projectile").id
        self._geom = body.model.geom("projectile").id
        self._pushing, self._overlap = True, 0.0
        body.data.xfrc_applied[self._index, :3] = force

    @property
    def timestep(self) -> float:
        """The step of the simulation, s."""
        return self.body.timestep

    @property
    def weights(self) -> Floats:
        """(N,) mass fraction at each vertex, without the projectile."""
        return self.body.weights

    @property
    def positions(self) -> Floats:
        """(N, 3) metres."""
        return self.body.positions

    @property
    def velocities(self) -> Floats:
        """(N, 3) m/s, a view."""
        return self.body.velocities

    @property
    def centre(self) -> Vector:
        """(3,) m: the projectile's centre."""
        return self.body.data.xpos[self._index].copy()

    def step(self, force: Floats | None = None) -> None:
        """Advance by one time step under `force` (N, 3) in newton at the vertices."""
        model, data = self.body.model, self.body.data
        if self._pushing and data.time > self._pulse - 0.5 * self.timestep:
            self._pushing = False
            data.xfrc_applied[self._index] = 0.0
            data.qvel[0] = 0.0
            model.geom_contype[self._geom] = model.geom_conaffinity[self._geom] = 0
        self.body.step(force)
        if self._pushing:
            mine = (data.contact.geom == self._geom).any(axis=1)
            self._overlap = max(self._overlap, -float(data.contact.dist[mine].min(initial=0.0)))

    def check(self) -> None:
        """Raise `SimulationError` unless the run so far is sound, and the projectile has stayed outside of the body."""
        self.body.check()
        if self._overlap > SUNK:
            raise SimulationError(
                f"the projectile overlaps the body by {1e3 * self._overlap:.1f} mm, of at most {1e3 * SUNK:g}"
            )
