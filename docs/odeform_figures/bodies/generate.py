"""Instances of the seven classes of objects, made from their shapes."""

from collections.abc import Callable, Mapping
from importlib import import_module
from types import ModuleType

import numpy as np

from odeform.errors import InputError
from odeform.geometry.normals import vertex_normals
from odeform.simulation.objects.catalog import OBJECTS
from odeform.simulation.objects.materials import FORCES, MATERIALS
from odeform.simulation.objects.settling import settle
from odeform.simulation.objects.soft_object import SoftObject
from odeform.simulation.objects.thickness import median_thickness
from odeform.types import Mesh, Perpoint, Points
from odeform_figures.bodies.level_set import surface_of
from odeform_figures.bodies.remesh import remesh
from odeform_figures.bodies.tetrahedra import small_solid

__all__ = ["COUNT", "generate", "proportions", "surface"]

COUNT = 1150  # surface vertices
COUNTS = {"flip-flop": 1300}  # more where flat parts are merged
COARSE, FINE = 0.010, 0.45  # m, edges of a first surface, which gives the area; edges of the second, relative to ours


def generate(name: str, variant: int | None = None, factors: Mapping[str, float] | None = None) -> SoftObject:
    """An instance of the class `name`, settled on the floor; `variant` is the seed of its proportions, None standard.

    `factors` are the proportions themselves, by the names of the class's `RANGES`, in place of a seed. Needs the extra
    `dev`. Raises `InputError` for an unknown name and `SimulationError` if it is too large or keeps moving.
    """
    if name not in OBJECTS:
        raise InputError(f"object {name!r}: expected one of {', '.join(OBJECTS)}")
    mesh = surface(name, proportions(name, variant) if factors is None else factors)
    if name == "chip":
        points, elements, faces = mesh.points, mesh.faces, mesh.faces
    else:
        points, elements, faces = small_solid(mesh)
    material = MATERIALS[name]
    settled = settle(points, elements, material)
    thickness = (
        float(np.ptp(settled[:, 2])) if name == "chip" else median_thickness(Mesh(points[: faces.max() + 1], faces))
    )
    return SoftObject(name, points, elements, faces, settled, material, FORCES[name], thickness)


def proportions(name: str, variant: int | None) -> dict[str, float]:
    """Returns the proportions of a variant, factors on the standard instance's: uniform over the class's ranges."""
    if variant is None:
        return {}
    rng = np.random.default_rng([variant, OBJECTS.index(name)])
    return {key: float(rng.uniform(*span)) for key, span in _shape(name).RANGES.items()}


def surface(name: str, factors: Mapping[str, float]) -> Mesh:
    """Returns the surface of an instance, about `COUNT` even triangles' vertices, in metres; the middle surface of the
    chip.

    `InputError` for a proportion that the class does not have.
    """
    shape = _shape(name)
    if unknown := sorted(set(factors) - set(shape.RANGES)):
        raise InputError(f"object {name!r}: expected proportions {', '.join(shape.RANGES)}, got {', '.join(unknown)}")
    if name == "chip":
        return shape.chip(**factors)

    def distance(points: Points) -> Perpoint:
        return shape.distance(points, **factors)

    coarse = surface_of(distance, COARSE)
    corners = coarse.points[coarse.faces]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    fine = surface_of(distance, FINE * float(np.sqrt(area / COUNT)))
    mesh = remesh(fine, COUNTS.get(name, COUNT))
    return Mesh(_projected(mesh, distance), mesh.faces)


def _shape(name: str) -> ModuleType:
    return import_module(f"odeform_figures.bodies.shapes.{name.replace('-', '_')}")


def _projected(mesh: Mesh, distance: Callable[[Points], Perpoint]) -> Points:
    """The vertices, moved along their normals to distance 0: as means of clusters they lie inside of bends."""
    points = np.asarray(mesh.points, dtype=float)
    normals = vertex_normals(points, mesh.faces)
    for _ in range(3):
        points = points - distance(points)[:, None] * normals
    return points
