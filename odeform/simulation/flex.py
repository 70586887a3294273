"""A MuJoCo flex, or several like ones, whose vertices are the degrees of freedom.

Shells and solids differ in their model's XML alone.
"""

# MuJoCo is a compiled module without type stubs
# pyright: reportAttributeAccessIssue=false

from dataclasses import dataclass

import mujoco
import numpy as np

from odeform.simulation.errors import SimulationError
from odeform.types import Floats, Ints, Perpoint, Points

__all__ = ["CONTACT_RADIUS", "ITERATIONS", "Contact", "FlexBody", "flex_xml"]

CONTACT_RADIUS = 0.001  # MuJoCo's contact skin around each vertex; the floor lies this much below z = 0
ITERATIONS = 500  # of the constraint solver; the stiffest contacts take half as many


@dataclass(frozen=True)
class Contact:
    """How a body meets the floor and everything else."""

    friction: float
    """Coulomb coefficient."""
    time: float
    """MuJoCo's `solref` time constant in seconds, of critically damped contacts."""

    @property
    def xml(self) -> str:
        """Attributes of a geom or a flex."""
        return f'friction="{self.friction} 0.005 0.0001" solref="{self.time} 1"'


def flex_xml(
    points: Points,
    elements: Ints,
    mass: float,
    elasticity: str,
    contact: Contact,
    step: float,
    gravity: float,
    floor: bool = True,
    others: str = "",
    solver: str = 'solver="CG"',
    bodies: int = 1,
) -> str:
    """The MuJoCo model of a flex, whose `elements` are (M, 3) triangles of a shell or (M, 4) tetrahedra, or of so many
    like `bodies`.

    `elasticity` holds the attributes of the element of that name, `others` the XML of further bodies, and `solver` the
    attributes of the constraint solver. `mass` is in kg, `step` in s, `gravity` in m/s^2 along -z.
    """
    plane = f'<geom type="plane" size="0 0 1" pos="0 0 {-CONTACT_RADIUS}" {contact.xml}/>' if floor else ""
    coordinates = " ".join(f"{x:.17g}" for x in np.asarray(points, dtype=float).ravel())
    corners = " ".join(map(str, np.asarray(elements).ravel()))
    flexes = "".join(
        f"""
    <body name="body{index}"><flexcomp name="flex{index}" type="direct" dim="{np.shape(elements)[1] - 1}" mass="{mass}"
      radius="{CONTACT_RADIUS}" point="{coordinates}" element="{corners}">
      <contact selfcollide="none" {contact.xml}/>
      <elasticity {elasticity}/>
    </flexcomp></body>"""
        for index in range(bodies)
    )
    return f"""<mujoco>
  <option timestep="{step}" integrator="discrete" gravity="0 0 {-gravity}"
    iterations="{ITERATIONS}" {solver}/>
  <worldbody>{plane}{others}{flexes}
  </worldbody>
</mujoco>"""


class FlexBody:
    """A flexible body of N vertices, or several like ones of N in all, stepped in time. It is a
    `odeform.simulation.stepping.Body`.

    Its coordinates are the last of the model; other bodies come before it.

    MuJoCo's implicit step resists rigid rotation: in 0.1 s a free shell of EI = 3 N m loses 80 % of its spin, a free
    solid turning at 18 rad/s up to 11 % (step 1 ms). The bending of shells is treated as if it turned with the world,
    and vertices that move along tangents stretch the body, which is pulled back. Internal forces exert no torque, so
    `step` restores the angular momentum, which only the contact and the applied forces may change.
    """

    def __init__(self, xml: str, reference: Points, mass_fractions: Perpoint | None = None, bodies: int = 1) -> None:
        """`xml` is the MuJoCo model; `reference` (N, 3) m are the positions at which all its coordinates are 0.

        `mass_fractions` (N,) are the vertices' mass fractions; by default all are equal. The vertices are those of so
        many `bodies`, one after the other.
        """
        self.model = mujoco.MjModel.from_xml_string(xml)
        self.data = mujoco.MjData(self.model)
        if mass_fractions is not None:
            masses = self.model.body_mass[-len(mass_fractions) :]
            masses[:] = masses.sum() * mass_fractions
            mujoco.mj_setConst(self.model, self.data)
        self._reference = np.array(reference, dtype=float)
        self._coordinates = self.data.qpos[-self._reference.size :].reshape(-1, 3)
        self._velocities = self.data.qvel[-self._reference.size :].reshape(-1, 3)
        self._applied = self.data.qfrc_applied[-self._reference.size :].reshape(-1, 3)
        self.masses = self.model.body_mass[-len(self._reference) :].copy()
        self.weights = self.masses / self.masses.sum()
        size = len(self._reference) // bodies
        self._bodies = [slice(size * index, size * (index + 1)) for index in range(bodies)]
        self._converged = True

    @property
    def timestep(self) -> float:
        """The step of the simulation, s."""
        return self.model.opt.timestep

    @property
    def positions(self) -> Floats:
        """(N, 3) metres."""
        return self._reference + self._coordinates

    @positions.setter
    def positions(self, value: Floats) -> None:
        self._coordinates[:] = value - self._reference

    @property
    def velocities(self) -> Floats:
        """(N, 3) m/s, a view that may be written to."""
        return self._velocities

    @property
    def contact_forces(self) -> Floats:
        """(N, 3) N at the vertices, from all contacts during the last step."""
        return self.data.qfrc_constraint[-self._reference.size :].reshape(-1, 3)

    def step(self, force: Floats | None = None) -> None:
        """Advance by one time step under `force` (N, 3) in newton at the vertices."""
        self._applied[:] = 0.0 if force is None else force
        before = [self._centred(body) for body in self._bodies]
        momenta = [self._angular_momentum(arms, body) for arms, body in zip(before, self._bodies, strict=True)]
        mujoco.mj_step(self.model, self.data)
        if self.data.warning.number.any():
            self.check()
        self._converged &= bool(self.data.solver_niter.max() < ITERATIONS)
        external = self.contact_forces + self._applied
        for body, arms, begun in zip(self._bodies, before, momenta, strict=True):
            momentum = begun + self.model.opt.timestep * np.cross(arms, external[body]).sum(axis=0)
            after, masses = self._centred(body), self.masses[body]
            inertia = (masses * (after**2).sum(axis=1)).sum() * np.eye(3) - (masses[:, None] * after).T @ after
            spin = np.linalg.solve(inertia, momentum - self._angular_momentum(after, body))
            self.velocities[body] += np.cross(spin, after)

    def _centred(self, body: slice) -> Floats:
        positions, masses = self.positions[body], self.masses[body]
        return positions - masses / masses.sum() @ positions

    def _angular_momentum(self, centred: Floats, body: slice) -> Floats:
        return np.cross(centred, self.masses[body, None] * self.velocities[body]).sum(axis=0)

    def check(self) -> None:
        """Raise `SimulationError` unless the run so far is finite, converged and free of solver warnings."""
        warnings = [w.number for w in self.data.warning]
        if any(warnings):
            raise SimulationError(f"MuJoCo warnings (contact full, constraint full, ..., divergence): {warnings}")
        if not self._converged:
            raise SimulationError(f"the constraint solver has not converged in {ITERATIONS} iterations")
        if not np.isfinite(self.data.qpos).all():
            raise SimulationError("non-finite positions")
