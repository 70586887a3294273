"""Soft shells, open or closed, on MuJoCo flexes."""

# MuJoCo is a compiled module without type stubs
# pyright: reportAttributeAccessIssue=false

import mujoco
import numpy as np

from odeform.simulation.flex import CONTACT_RADIUS, ITERATIONS, FlexBody
from odeform.simulation.material import Material, damping_time
from odeform.types import Floats, Mesh

__all__ = ["ShellBody", "relax"]


def _xml(
    mesh: Mesh, mass: float, thickness: float, material: Material, step: float, gravity: float, floor: bool
) -> str:
    # the implicit step damps like `step` seconds of its own; taken off, a rebound hardly depends on the step
    damping = max(damping_time(thickness, material) - step, 0.0)
    contact = f'friction="{material.friction} 0.005 0.0001" solref="{material.contact_time} 1"'
    plane = f'<geom type="plane" size="0 0 1" pos="0 0 {-CONTACT_RADIUS}" {contact}/>' if floor else ""
    points = " ".join(f"{x:.17g}" for x in np.asarray(mesh.points, dtype=float).ravel())
    elements = " ".join(map(str, np.asarray(mesh.faces).ravel()))
    return f"""<mujoco>
  <option timestep="{step}" integrator="discrete" gravity="0 0 {-gravity}"
    solver="CG" iterations="{ITERATIONS}"/>
  <worldbody>{plane}
    <body name="body"><flexcomp name="shell" type="direct" dim="2" mass="{mass}" radius="{CONTACT_RADIUS}"
      point="{points}" element="{elements}">
      <contact selfcollide="none" {contact}/>
      <elasticity young="{material.young}" poisson="{material.poisson}" damping="{damping}"
        thickness="{thickness}" elastic2d="both"/>
    </flexcomp></body>
  </worldbody>
</mujoco>"""


class ShellBody(FlexBody):
    """One shell over a floor.

    MuJoCo treats the bending force as if it turned with the world and not with the body: both its damping and the
    linearisation behind its implicit step resist rigid rotation (at EI = 3 N m a free ball loses 80 % of its spin
    in 0.1 s). Internal forces exert no torque, so `step` gives the body back the angular momentum which only the
    contact and the applied forces may change.
    """

    def __init__(
        self,
        reference: Mesh,
        mass: float,
        thickness: float,
        material: Material,
        step: float,
        gravity: float,
        floor: bool = True,
    ) -> None:
        """`mass` in kg, wall `thickness` in m, time `step` in s, `gravity` in m/s^2 along -z."""
        super().__init__(_xml(reference, mass, thickness, material, step, gravity, floor), reference.points)

    def _centred(self) -> Floats:
        positions = self.positions
        return positions - self.weights @ positions

    def _angular_momentum(self, centred: Floats) -> Floats:
        return np.cross(centred, self.masses[:, None] * self.velocities).sum(axis=0)

    def step(self, force: Floats | None = None) -> None:
        """Advance by one time step under `force` (N, 3) in newton at the vertices."""
        before = self._centred()
        momentum = self._angular_momentum(before)
        super().step(force)
        external = (self.data.qfrc_constraint + self.data.qfrc_applied).reshape(-1, 3)
        momentum = momentum + self.model.opt.timestep * np.cross(before, external).sum(axis=0)
        after = self._centred()
        inertia = (self.masses * (after**2).sum(axis=1)).sum() * np.eye(3) - (self.masses[:, None] * after).T @ after
        spin = np.linalg.solve(inertia, momentum - self._angular_momentum(after))
        self.velocities[:] += np.cross(spin, after)


def relax(reference: Mesh, thickness: float, material: Material) -> Mesh:
    """The shape in which a shell built from `reference` is free of stress, centred at its mean point.

    The bending energy of MuJoCo's shells has no curved rest state: a curved shell changes shape as soon as it is
    simulated. Without gravity, in large implicit steps with all velocity removed (a damped Newton iteration), it finds
    its equilibrium.
    """
    body = ShellBody(reference, 1.0, thickness, material, step=0.05, gravity=0.0, floor=False)
    for _ in range(40):
        mujoco.mj_step(body.model, body.data)
        body.velocities[:] = 0.0
    body.check()
    return Mesh(body.positions - body.positions.mean(axis=0), reference.faces)
