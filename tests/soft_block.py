"""A block of soft tetrahedra on the floor, as reduced mechanics knows it."""

from dataclasses import dataclass

import numpy as np

from odeform.mechanics.body import ReducedBody, reduce_body, solid_of
from odeform.mechanics.elasticity import ElasticModes, elastic_modes, tangent_stiffness
from odeform.mechanics.warping import surface_turns
from odeform.simulation.objects.soft_object import SoftMaterial, SoftObject
from odeform.types import Floats, Ints, Points

SIZE = np.array([0.12, 0.08, 0.06])  # m
CELLS = (4, 3, 2)
YOUNG, POISSON, DENSITY = 4e4, 0.3, 400.0


@dataclass(frozen=True, eq=False)
class Block:
    points: Points
    elements: Ints
    masses: Floats
    modes: ElasticModes
    body: ReducedBody


def grid(cells: tuple[int, int, int] = CELLS, size: Floats = SIZE) -> tuple[Points, Ints]:
    """Nodes (N, 3) and tetrahedra (M, 4): six in each of the cells of a box of `size` m that stands on z = 0."""
    counts = np.array(cells) + 1
    index = np.arange(counts.prod()).reshape(counts)
    points = np.stack(np.meshgrid(*(np.linspace(0, 1, n) for n in counts), indexing="ij"), axis=-1).reshape(-1, 3)
    cell = np.stack(
        [
            index[i : i + cells[0], j : j + cells[1], k : k + cells[2]].ravel()
            for i in (0, 1)
            for j in (0, 1)
            for k in (0, 1)
        ],
        axis=1,
    )
    paths = [[0, 4, 6, 7], [0, 4, 5, 7], [0, 2, 6, 7], [0, 2, 3, 7], [0, 1, 5, 7], [0, 1, 3, 7]]
    return points * size - [0.5 * size[0], 0.5 * size[1], 0.0], np.concatenate([cell[:, path] for path in paths])


def outside(elements: Ints, points: Points) -> Ints:
    """(F, 3) faces of one tetrahedron only, outward."""
    faces = np.concatenate([elements[:, list(corners)] for corners in ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))])
    other = np.concatenate([elements[:, i] for i in (3, 2, 1, 0)])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    faces, other = faces[first[count == 1]], other[first[count == 1]]
    a, b, c = (points[faces[:, i]] for i in range(3))
    inward = np.einsum("fi,fi->f", np.cross(b - a, c - a), points[other] - a) > 0.0
    faces[inward] = faces[inward][:, ::-1]
    return faces


def make_block() -> Block:
    """The block, with its modes."""
    points, elements = grid()
    corners = points[elements]
    volume = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0
    masses = np.bincount(elements.ravel(), np.repeat(DENSITY * volume / 4.0, 4), len(points))
    modes = elastic_modes(tangent_stiffness(points, elements, points, YOUNG, POISSON), masses, points, 12)
    faces = outside(elements, points)
    surface = np.unique(faces)
    number = np.zeros(len(points), dtype=int)
    number[surface] = np.arange(len(surface))
    centre = masses @ points / masses.sum()
    solid = solid_of(points, masses, 0.004)
    shapes = modes.shapes[:, surface]
    turns = surface_turns(points[surface], number[faces], shapes.transpose(1, 2, 0))
    fractions = masses[surface] / masses[surface].sum()
    body = reduce_body(points[surface] - centre, number[faces], shapes, turns, modes.eigenvalues, solid, fractions)
    return Block(points, elements, masses, modes, body)


def block_object(name: str = "block") -> SoftObject:
    """The block as a soft object that a user could have brought, its inner nodes last, not yet settled."""
    points, elements = grid()
    faces = outside(elements, points)
    surface = np.unique(faces)
    order = np.concatenate([surface, np.setdiff1d(np.arange(len(points)), surface)])
    number = np.argsort(order)
    points = points[order]
    elements = number[elements]
    corners = points[elements]
    mirrored = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0.0
    elements[mirrored] = elements[mirrored][:, [0, 2, 1, 3]]
    material = SoftMaterial(YOUNG, POISSON, DENSITY, 0.004, 0.6, "a block for tests")
    return SoftObject(name, points, elements, number[faces].astype(np.int32), points, material, (1.0, 4.0), 0.06)
