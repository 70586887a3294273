"""A soft body that a scene simulates: its nodes, elements and material."""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from scipy.spatial import KDTree

from odeform.types import Faces, Floats, Ints, Mesh, Perpoint, Points

__all__ = ["SoftMaterial", "SoftObject", "nodal_masses"]


@dataclass(frozen=True)
class SoftMaterial:
    """A material, SI units."""

    young: float
    """Young's modulus in Pa."""
    poisson: float
    """Poisson's ratio."""
    density: float
    """kg/m^3."""
    damping: float
    """Stiffness-proportional damping in seconds."""
    friction: float
    """Coulomb coefficient against the floor and the projectile."""
    source: str
    """Source of the figures, in one line."""
    thickness: float = 0.0
    """Thickness of a shell in metres; 0 for a solid."""


@dataclass(frozen=True, eq=False)
class SoftObject:
    """A soft body of N nodes, of which the first S lie on its surface."""

    name: str
    points: Points
    """(N, 3) m, the nodes without stress. A shell bends from the curvature that it has here."""
    elements: Ints
    """(M, 4) tetrahedra of a solid or (M, 3) triangles of a shell: indices of nodes."""
    faces: Faces
    """(F, 3) triangles of the surface, outward: indices below S."""
    settled: Points
    """(N, 3) m, the nodes at rest on the floor z = 0 under gravity, their mass centred at x = y = 0."""
    material: SoftMaterial
    forces: tuple[float, float]
    """Weakest and strongest force of a pulse on it, in newton."""
    thickness: float
    """Metres through the body behind its surface (median); of a shell, its height. Dents are judged against it."""

    @property
    def surface_count(self) -> int:
        """S, the number of surface vertices."""
        return int(self.faces.max()) + 1

    @cached_property
    def masses(self) -> Perpoint:
        """(N,) kg at each node."""
        return nodal_masses(self.points, self.elements, self.material)

    @property
    def mass(self) -> float:
        """Kilograms."""
        return float(self.masses.sum())

    @cached_property
    def weights(self) -> Perpoint:
        """(S,) mass fraction at each surface vertex, summing to 1. Inner nodes count for the nearest one."""
        count = self.surface_count
        nearest = np.arange(len(self.points))
        if count < len(self.points):
            nearest[count:] = KDTree(self.points[:count]).query(self.points[count:])[1]
        return np.bincount(nearest, self.masses, count) / self.mass

    def changed(self, mass: float, young: float) -> "SoftObject":
        """Returns the same body of another mass in kg and Young's modulus in Pa, where it then comes to rest.

        It takes some seconds, unless it was asked for before. Raises `SimulationError` where it collapses.
        """
        if np.isclose(mass, self.mass, rtol=1e-6) and np.isclose(young, self.material.young, rtol=1e-6):
            return self
        return _changed(self, float(mass), float(young))

    def rest_mesh(self) -> Mesh:
        """Returns the surface of the settled body: S vertices in metres."""
        return Mesh(self.settled[: self.surface_count].astype(np.float32), self.faces)


@lru_cache(maxsize=16)
def _changed(item: SoftObject, mass: float, young: float) -> SoftObject:
    from odeform.simulation.objects.settling import settle  # it needs the simulator

    material = replace(item.material, young=young, density=item.material.density * mass / item.mass)
    return replace(item, material=material, settled=settle(item.points, item.elements, material))


def nodal_masses(points: Points, elements: Ints, material: SoftMaterial) -> Floats:
    """(N,) kg: every element gives an equal part of its mass to each of its nodes."""
    corners = np.asarray(points, dtype=float)[elements]
    sides = corners[:, 1:] - corners[:, :1]
    if elements.shape[1] == 4:
        sizes = np.abs(np.linalg.det(sides)) / 6.0
    else:
        sizes = 0.5 * material.thickness * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    part = material.density * sizes / elements.shape[1]
    masses = np.zeros(len(points))
    np.add.at(masses, elements, part[:, None])
    return masses
