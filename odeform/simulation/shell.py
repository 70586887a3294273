"""Soft shells, open or closed, on MuJoCo flexes."""

# MuJoCo is a compiled module without type stubs
# pyright: reportAttributeAccessIssue=false

import mujoco

from odeform.simulation.flex import Contact, FlexBody, flex_xml
from odeform.simulation.material import Material, damping_time
from odeform.types import Mesh

__all__ = ["ShellBody", "relax"]


def _xml(
    mesh: Mesh, mass: float, thickness: float, material: Material, step: float, gravity: float, floor: bool
) -> str:
    # the implicit step damps like `step` seconds of its own; taken off, a rebound hardly depends on the step
    damping = max(damping_time(thickness, material) - step, 0.0)
    elasticity = (
        f'young="{material.young}" poisson="{material.poisson}" damping="{damping}" '
        f'thickness="{thickness}" elastic2d="both"'
    )
    contact = Contact(material.friction, material.contact_time)
    return flex_xml(mesh.points, mesh.faces, mass, elasticity, contact, step, gravity, floor)


class ShellBody(FlexBody):
    """One shell over a floor."""

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


def relax(reference: Mesh, thickness: float, material: Material) -> Mesh:
    """The shape in which a shell built from `reference` is free of stress, centred at its mean point.

    MuJoCo's shells rest at the curvature of `reference`, but only to the first order of the angles between triangles:
    a ball of 162 vertices grows by 0.8 to 4 % as soon as it is simulated. Without gravity, in large implicit steps with
    all velocity removed (a damped Newton iteration), it finds its equilibrium.
    """
    body = ShellBody(reference, 1.0, thickness, material, step=0.05, gravity=0.0, floor=False)
    for _ in range(40):
        mujoco.mj_step(body.model, body.data)
        body.velocities[:] = 0.0
    body.check()
    return Mesh(body.positions - body.positions.mean(axis=0), reference.faces)
