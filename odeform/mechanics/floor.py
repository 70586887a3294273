"""The floor z = 0 under a body: stiff springs under the samples of its support."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize

from odeform.mechanics.body import ReducedBody
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.surroundings import GRAVITY
from odeform.types import Floats, Perpoint

__all__ = ["Floor", "stand"]

TOUCHING = 4.0  # inverse of the fraction of a body's surface that typically stands


@dataclass(frozen=True, eq=False)
class Floor:
    """A body's springs to the floor, in equilibrium with its weight where it rests."""

    level: Perpoint
    """(S,) m added to the heights of the support's samples above the mass centre at rest, for their gaps: with it, the
    springs balance weight and torque."""
    stiffness: Perpoint
    """(S,) N/m of each sample."""
    preload: Float[np.ndarray, " modes"]
    """(K,) modal force of the floor at rest, which the body's own stress balances."""

    def under_any_side(self, height: float) -> "Floor":
        """The same springs for a body that may lie on any side; its mass centre rests at `height` m."""
        return replace(self, level=np.full_like(self.level, height))


def stand(body: ReducedBody, parameters: ContactParameters) -> Floor:
    """Finds the springs, and the height and tilt of the floor at which they carry the body without turning it.

    The equilibrium is the minimum of the potential energy of the springs and the weight, which is convex.
    """
    x, y, z = body.support.points.T
    weight, size = body.solid.mass * GRAVITY, float(np.sqrt((body.support.points**2).sum(axis=1).mean()))
    stiffness = TOUCHING * weight / parameters.static_penetration * body.support.masses / body.solid.mass
    shape = np.stack([np.ones_like(x), x / size, y / size])
    low = z - z.min()

    def energy(plane: Floats) -> tuple[float, Floats]:
        depth = np.maximum(parameters.static_penetration * (plane @ shape) - low, 0.0)
        value = 0.5 * stiffness @ depth**2 - weight * parameters.static_penetration * plane[0]
        slope = (
            parameters.static_penetration * (shape @ (stiffness * depth))
            - weight * parameters.static_penetration * np.eye(3)[0]
        )
        return value / (weight * parameters.static_penetration), slope / (weight * parameters.static_penetration)

    plane = minimize(energy, np.array([1.0, 0.0, 0.0]), jac=True, method="BFGS", options={"gtol": 1e-10}).x
    offset = -parameters.static_penetration * (plane @ shape)
    force = stiffness * np.maximum(-(low + offset), 0.0)
    return Floor(offset - z.min(), stiffness, force @ body.support.rows[2])
