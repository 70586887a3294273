"""Contacts and forces that fill the surface of a body evenly."""

import numpy as np
from scipy.stats import qmc

from odeform.geometry.contact import CONE, surface_point, touching_centre
from odeform.simulation.contacts import Forces, forces_there
from odeform.types import Floats, Ints, Mesh, Vector

__all__ = ["contact_draws", "in_cone_about"]

BATCH = 256  # candidates at a time, a power of 2 as Sobol points want
LEVELS = 10  # bits of each coordinate in the order of the faces


def contact_draws(rest: Mesh, forces: Forces, count: int, seed: list[int]) -> list[tuple[Vector, Vector]]:
    """Draws `count` pairs of a contact (3,) m on the surface and a force (3,) N, of scrambled Sobol points.

    Contacts are uniform over the area where the sphere fits, directions over the cone about the inward normal, and
    magnitudes from the weakest to the strongest of `forces`. A longer list with the same seed starts with the shorter.
    """
    sobol = qmc.Sobol(6, scramble=True, rng=np.random.default_rng(seed))
    order = _along_curve(rest)
    corners = np.asarray(rest.points, dtype=float)[rest.faces[order]]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    ends = np.cumsum(areas) / areas.sum()
    drawn: list[tuple[Vector, Vector]] = []
    while len(drawn) < count:
        for u in sobol.random(BATCH):
            face = order[min(int(np.searchsorted(ends, u[0])), len(order) - 1)]
            root = np.sqrt(u[1])
            contact = surface_point(rest, int(face), np.array([1.0 - root, root * (1.0 - u[2]), root * u[2]]))
            if touching_centre(rest, contact) is None:
                continue
            direction = in_cone_about(-contact.normal, u[3], u[4])
            weakest, strongest = forces_there(forces, contact)
            drawn.append((contact.point, (weakest + u[5] * (strongest - weakest)) * direction))
            if len(drawn) == count:
                break
    return drawn


def in_cone_about(axis: Floats, across: float, around: float) -> Vector:
    """Computes a unit vector (3,) in the cone about a unit vector, uniform for `across` and `around` uniform in [0,
    1]."""
    side = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    side /= np.linalg.norm(side)
    cosine = 1.0 - across * (1.0 - np.cos(CONE))
    sine, angle = np.sqrt(1.0 - cosine**2), 2.0 * np.pi * around
    return cosine * axis + sine * (np.cos(angle) * side + np.sin(angle) * np.cross(axis, side))


def _along_curve(mesh: Mesh) -> Ints:
    """(F,) the faces in Morton order: those near each other in the list are near on the body, mostly."""
    centres = np.asarray(mesh.points, dtype=float)[mesh.faces].mean(axis=1)
    low, size = centres.min(axis=0), np.ptp(centres, axis=0).max()
    cells = ((centres - low) / size * (2**LEVELS - 1)).astype(np.int64)
    code = np.zeros(len(cells), dtype=np.int64)
    for bit in range(LEVELS):
        for axis in range(3):
            code |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")
