"""How an elastic body rests on the floor under its weight: an equilibrium, found without following a motion."""

import numpy as np
from scipy.sparse import csc_matrix, diags
from scipy.sparse.linalg import splu
from scipy.spatial import ConvexHull

from odeform.geometry.solids.tetrahedra import inside_out
from odeform.mechanics.elasticity import elastic_forces, tangent_stiffness
from odeform.surroundings import GRAVITY
from odeform.types import Floats, Ints, Perpoint, Points, Rotations, Vector

__all__ = ["lying", "sag", "standing"]

SINKS = 5e-5  # m, of the whole weight on one node into the floor
TOUCHES = 6  # times that what touches the floor is found anew, in one step
STEPS, FIRST, LONGEST = 14, 0.005, 1.0  # of pseudo time; s, the first and the longest of them
STILL = 1e-3  # acceleration that is left, relative to gravity
FOOT = 0.02  # of the height, near the floor
ROLLS = 30  # over edges of its hull, at most


def lying(points: Points, masses: Perpoint) -> Rotations:
    """The rotation (3, 3) with which a rigid body comes to rest on the floor: it rolls over edges of its hull until
    its mass centre is above the side that it lies on."""
    hull, centre = ConvexHull(points), masses @ points / masses.sum()
    normals = hull.equations[:, :3]
    height = -(normals @ centre + hull.equations[:, 3])
    floor = np.array([0.0, 0.0, -1.0])
    down: Vector = floor
    for _ in range(ROLLS):
        towards = normals @ down
        facet = int(np.where(towards > 1e-9, height / np.maximum(towards, 1e-9), np.inf).argmin())
        if normals[facet] @ down > 1.0 - 1e-9:
            break
        down = normals[facet]
    return _turning(down, floor)


def _turning(one: Vector, other: Vector) -> Rotations:
    """The least rotation (3, 3) of one unit vector to another."""
    axis, cosine = np.cross(one, other), float(one @ other)
    if cosine < -1.0 + 1e-9:
        return np.diag([1.0, -1.0, -1.0])
    across = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.eye(3) + across + across @ across / (1.0 + cosine)


def sag(points: Points, elements: Ints, masses: Perpoint, young: float, poisson: float) -> float:
    """How far the body gives way under its weight, relative to its height, as long as that is little.

    `points` (N, 3) m are without stress, `young` is in Pa. The nodes near the floor do not sink.
    """
    height = points[:, 2] - points[:, 2].min()
    held = np.zeros((len(points), 3))
    held[height < FOOT * height.max(), 2] = float(masses.sum()) * GRAVITY / SINKS
    stiffness = tangent_stiffness(points, elements, points, young, poisson)
    matrix = (stiffness + diags(held.ravel() + np.repeat(masses, 3))).tocsc()
    weight = np.zeros_like(held)
    weight[:, 2] = -masses * GRAVITY
    found = splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve(weight.ravel())
    return float(np.abs(found.reshape(-1, 3)[:, 2]).max() / height.max())


def standing(
    points: Points, elements: Ints, masses: Perpoint, young: float, poisson: float, least: float = 0.0
) -> tuple[Points, bool]:
    """Where nodes (N, 3) m of tetrahedra (M, 4) are when they stand on the floor z = 0, and whether they came to rest.

    `points` are without stress, `young` is in Pa. A body that becomes lower than `least` m has not. Newton's method in
    steps of a pseudo time, which the inertia of the nodes, `masses` (N,) kg, holds back; steps that turn a tetrahedron
    inside out are taken again, shorter.
    """
    positions = points - [0.0, 0.0, points[:, 2].min()]
    mass, step = float(masses.sum()), FIRST
    stiff = mass * GRAVITY / SINKS
    left = _forces(points, elements, positions, masses, young, poisson)
    for _ in range(STEPS):
        matrix = tangent_stiffness(points, elements, positions, young, poisson) + diags(np.repeat(masses / step**2, 3))
        moved = _stepped(matrix, left, positions, stiff)
        if not np.isfinite(moved).all() or inside_out(moved, elements).any():
            step *= 0.25
            continue
        if np.ptp(moved[:, 2]) < least:
            return moved, False
        positions, left = moved, _forces(points, elements, moved, masses, young, poisson)
        still = left.copy()
        still[:, 2] += stiff * np.maximum(-positions[:, 2], 0.0)
        if np.sqrt((still**2 / masses[:, None]).sum() / mass) < STILL * GRAVITY:
            return positions, True
        step = min(4.0 * step, LONGEST)
    return positions, False


def _stepped(matrix: csc_matrix, left: Floats, positions: Points, stiff: float) -> Points:
    """(N, 3) m: one step of Newton's method, under forces `left` (N, 3) N besides those of the floor, which hold the
    nodes that would be below it."""
    held = positions[:, 2] <= 0.0
    moved = positions
    for _ in range(TOUCHES):
        floor = np.zeros_like(positions)
        floor[held, 2] = stiff
        system = (matrix + diags(floor.ravel())).tocsc()
        forces = left - floor * positions
        solver = splu(system, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        moved = positions + solver.solve(forces.ravel()).reshape(-1, 3)
        before, held = held, moved[:, 2] < 0.0
        if (held == before).all():
            break
    return moved


def _forces(
    points: Points, elements: Ints, positions: Points, masses: Perpoint, young: float, poisson: float
) -> Floats:
    """(N, 3) N of elasticity and weight."""
    found = elastic_forces(points, elements, positions, young, poisson)
    found[:, 2] -= masses * GRAVITY
    return found
