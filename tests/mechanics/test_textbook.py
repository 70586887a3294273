"""Frequencies and deflections of beams, bars and plates, by formulas of textbooks."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csc_matrix, diags
from scipy.sparse.linalg import eigsh, spsolve
from soft_block import grid

from odeform.mechanics.elasticity import elastic_modes, tangent_stiffness
from odeform.types import Floats, Ints, Points

LONG, THICK = 1.0, 0.1  # m
YOUNG, DENSITY = 1e6, 1000.0


def beam(finer: int, poisson: float) -> tuple[Points, Ints, Floats, Floats]:
    """Nodes, tetrahedra, nodal masses in kg and stiffness of a square beam, `finer` elements thick."""
    points, elements = grid((10 * finer, finer, finer), np.array([LONG, THICK, THICK]))
    corners = points[elements]
    volume = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0
    masses = np.bincount(elements.ravel(), np.repeat(DENSITY * volume / 4.0, 4), len(points))
    return points, elements, masses, tangent_stiffness(points, elements, points, YOUNG, poisson)


def refined(values: list[float]) -> float:
    """What values of 2 and 4 elements tend to, whose error falls by four."""
    return values[1] + (values[1] - values[0]) / 3.0


def test_a_free_beam_vibrates_as_euler_and_bernoulli_say() -> None:
    found = []
    for finer in (2, 4):
        points, _, masses, stiffness = beam(finer, 0.0)
        found.append(np.sqrt(elastic_modes(stiffness, masses, points, 8).eigenvalues))
    # in both directions across; the tetrahedra of a grid are not the same in both
    bending = refined([modes[:2].mean() for modes in found])
    rigidity = np.sqrt(YOUNG * THICK**4 / 12.0 / (DENSITY * THICK**2 * LONG**4))
    assert bending == pytest.approx(4.7300407**2 * rigidity, rel=0.02)
    # one of them is the first along the beam: half a wave of sound
    assert np.abs(found[1] - np.pi * np.sqrt(YOUNG / DENSITY) / LONG).min() < 0.05


def test_a_cantilever_vibrates_as_euler_and_bernoulli_say() -> None:
    found = []
    for finer in (2, 4):
        points, _, masses, stiffness = beam(finer, 0.0)
        free = np.repeat(points[:, 0] > points[:, 0].min() + 1e-9, 3)
        weights = diags(np.repeat(masses, 3)[free]).tocsc()
        squares = eigsh(stiffness[free][:, free], 2, weights, sigma=0.0, return_eigenvectors=False)
        found.append(np.sqrt(squares).mean())
    rigidity = np.sqrt(YOUNG * THICK**4 / 12.0 / (DENSITY * THICK**2 * LONG**4))
    assert refined(found) == pytest.approx(1.8751041**2 * rigidity, rel=0.02)


def test_a_bar_sags_under_its_own_weight() -> None:
    """Standing on end: by density g L^2 / (2 E)."""
    points, _, masses, stiffness = beam(2, 0.0)
    free = np.repeat(points[:, 0] > points[:, 0].min() + 1e-9, 3)
    weight = np.zeros_like(points)
    weight[:, 0] = -9.81 * masses
    moved = np.zeros(points.size)
    moved[free] = spsolve(stiffness[free][:, free], weight.ravel()[free])
    top = points[:, 0] > points[:, 0].max() - 1e-9
    assert moved[::3][top].mean() == pytest.approx(-DENSITY * 9.81 * LONG**2 / (2.0 * YOUNG), rel=0.01)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45])
def test_a_stretched_bar_gets_thinner(poisson: float) -> None:
    """Uniform strains are exact: stress is E strain, the sides give way by Poisson's ratio."""
    points, _, _, stiffness = beam(2, poisson)
    strained = points * [1e-3, -1e-3 * poisson, -1e-3 * poisson]
    force = (stiffness @ strained.ravel()).reshape(-1, 3)
    ends = points[:, 0] > points[:, 0].max() - 1e-9
    assert force[ends, 0].sum() == pytest.approx(1e-3 * YOUNG * THICK**2)
    inside = np.abs(points[:, 0]) < 0.5 * LONG - 1e-9
    np.testing.assert_allclose(force[inside], 0.0, atol=1e-12)
    np.testing.assert_allclose(force[:, 1:], 0.0, atol=1e-12)


def sheet(size: Floats, *counts: int) -> tuple[Points, Ints]:
    """A rectangle of two triangles a cell, in the plane z = 0."""
    x, y = np.meshgrid(*(np.linspace(0.0, s, n + 1) for s, n in zip(size, counts, strict=True)), indexing="ij")
    index = np.arange(x.size).reshape(x.shape)
    corners = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1).reshape(-1, 4)
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    return points, np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])


@pytest.mark.parametrize("poisson", [0.0, 0.3])
def test_a_stretched_sheet_gets_narrower(poisson: float) -> None:
    points, faces = sheet(np.array([0.2, 0.15]), 8, 6)
    stiffness = tangent_stiffness(points, faces, points, YOUNG, poisson, 0.002)
    force = (stiffness @ (points * [1e-3, -1e-3 * poisson, 0.0]).ravel()).reshape(-1, 3)
    assert force[points[:, 0] > 0.2 - 1e-9, 0].sum() == pytest.approx(1e-3 * YOUNG * 0.15 * 0.002)
    np.testing.assert_allclose(force[:, 1:], 0.0, atol=1e-12)


@pytest.mark.parametrize("poisson", [0.0, 0.3])
def test_a_strip_vibrates_as_kirchhoff_says(poisson: float) -> None:
    """Held straight across; hinges are softer against bending that follows their triangles."""
    points, faces = sheet(np.array([0.2, 0.01]), 40, 2)
    thickness = 5e-4
    stiffness = tangent_stiffness(points, faces, points, YOUNG, poisson, thickness)
    mass = DENSITY * thickness * 0.2 * 0.01
    column = np.repeat(np.arange(41), 3)
    straight = csc_matrix((np.ones(len(points)), (3 * np.arange(len(points)) + 2, column)), (points.size, 41))
    ends = np.where((np.arange(41) == 0) | (np.arange(41) == 40), 0.5, 1.0) / 40.0
    squares = eigh((straight.T @ stiffness @ straight).toarray(), np.diag(mass * ends), eigvals_only=True)
    rigidity = YOUNG * thickness**3 / (12.0 * (1.0 - poisson**2))
    expected = np.array([4.7300407, 7.8532046]) ** 2 / 0.2**2 * np.sqrt(rigidity / (DENSITY * thickness))
    np.testing.assert_allclose(squares[:2], 0.0, atol=1e-6 * squares[2])  # rigid
    np.testing.assert_allclose(np.sqrt(squares[2:4]), expected, rtol=0.01)
