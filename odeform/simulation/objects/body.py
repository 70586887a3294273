"""The MuJoCo body of a soft object: one flex of tetrahedra, or of triangles with bending."""

# MuJoCo is a compiled module without type stubs
# pyright: reportAttributeAccessIssue=false

import numpy as np

from odeform.simulation.flex import Contact, FlexBody, flex_xml
from odeform.simulation.objects.soft_object import SoftMaterial, nodal_masses
from odeform.simulation.physics import GRAVITY
from odeform.types import Ints, Points

__all__ = ["CONTACT_TIME", "SoftBody", "contact_of"]

CONTACT_TIME = 0.002  # s
"""Twice as long, and a projectile sinks 5 mm into a surface; stiffer in another way (`solimp`), and the constraint
solver does not always converge."""
TOLERANCE = 1e-6  # of the constraint solver; at 1e-8 positions differ by 1 micrometre, for a fifth more time


def contact_of(material: SoftMaterial) -> Contact:
    """Returns how bodies of this material meet others."""
    return Contact(material.friction, CONTACT_TIME)


class SoftBody(FlexBody):
    """A soft object over a floor: Saint Venant-Kirchhoff material or a shell, with stiffness-proportional damping."""

    def __init__(
        self,
        points: Points,
        elements: Ints,
        material: SoftMaterial,
        step: float,
        gravity: float = GRAVITY,
        floor: bool = True,
        others: str = "",
        bodies: int = 1,
    ) -> None:
        """Stress-free nodes (N, 3) m, elements (M, 4) or (M, 3), `step` in s, `gravity` in m/s^2 along -z.

        `others` is the XML of further bodies, besides so many like `bodies`, whose nodes follow each other.
        """
        # MuJoCo would give every node the same mass
        masses = nodal_masses(points, elements, material)
        total, mass_fractions = float(masses.sum()), np.tile(masses / masses.sum(), bodies) / bodies
        elasticity = f'young="{material.young}" poisson="{material.poisson}" damping="{_damping(material, step)}"'
        solver = f'solver="CG" tolerance="{TOLERANCE}"'
        if elements.shape[1] == 3:
            elasticity += f' thickness="{material.thickness}" elastic2d="both"'
            # conjugate gradients do not converge on the many contacts of a light shell with a heavy projectile
            solver = 'solver="Newton"'
        contact = contact_of(material)
        xml = flex_xml(points, elements, total, elasticity, contact, step, gravity, floor, others, solver, bodies)
        super().__init__(xml, np.tile(points, (bodies, 1)), mass_fractions, bodies)
        self._material = material

    def set_timestep(self, step: float) -> None:
        """Go on in steps of `step` seconds."""
        self.model.opt.timestep = step
        self.model.flex_damping[:] = _damping(self._material, step)


def _damping(material: SoftMaterial, step: float) -> float:
    # the implicit step damps like `step` seconds of its own; taken off, a motion hardly depends on the step
    return max(material.damping - step, 1e-6)
