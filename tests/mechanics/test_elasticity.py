"""Stiffness and modes of elastic bodies."""

import numpy as np
import pytest
from soft_block import POISSON, YOUNG, Block

from odeform.mechanics.elasticity import rigid_modes, tangent_stiffness


def energy(points, elements, positions, young, poisson) -> float:
    """Of Saint Venant-Kirchhoff tetrahedra, in joule; written independently of the package."""
    lame, shear = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))
    total = 0.0
    for corners, moved in zip(points[elements], positions[elements], strict=True):
        sides = (corners[1:] - corners[0]).T
        f = (moved[1:] - moved[0]).T @ np.linalg.inv(sides)
        e = 0.5 * (f.T @ f - np.eye(3))
        total += abs(np.linalg.det(sides)) / 6.0 * (0.5 * lame * np.trace(e) ** 2 + shear * (e * e).sum())
    return total


@pytest.mark.parametrize("strain", [0.0, 0.1])
def test_tangent_is_the_second_derivative_of_the_energy(block: Block, strain: float) -> None:
    generator = np.random.default_rng(0)
    points, elements = block.points, block.elements[::9]
    positions = points * (1.0 - strain * np.array([0.3, -0.5, 1.0])) + 0.01 * strain * generator.normal(
        size=points.shape
    )
    stiffness = tangent_stiffness(points, elements, positions, YOUNG, POISSON)
    for _ in range(3):
        way, step = generator.normal(size=points.shape), 1e-5
        ahead, here, back = (
            energy(points, elements, positions + s * step * way, YOUNG, POISSON) for s in (1.0, 0.0, -1.0)
        )
        curvature = (ahead - 2.0 * here + back) / step**2
        assert way.ravel() @ (stiffness @ way.ravel()) == pytest.approx(curvature, rel=1e-3)


def test_a_plate_bends_as_plate_theory_says() -> None:
    """Energy of a plate bent to a cylinder of radius R: area EI / (2 R^2), with small stretch."""
    count, size, radius, young, poisson, thickness = 21, 0.2, 5.0, 1e6, 0.3, 0.002
    x, y = np.meshgrid(np.linspace(0, size, count), np.linspace(0, size, count), indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), np.zeros(count**2)], axis=1)
    index = np.arange(count**2).reshape(count, count)
    a, b, c, d = index[:-1, :-1].ravel(), index[1:, :-1].ravel(), index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    stiffness = tangent_stiffness(points, faces, points, young, poisson, thickness)
    bent = np.zeros_like(points)
    bent[:, 2] = points[:, 0] ** 2 / (2.0 * radius)
    rigidity = young * thickness**3 / (12.0 * (1.0 - poisson**2))
    found = 0.5 * bent.ravel() @ (stiffness @ bent.ravel())
    assert found == pytest.approx(0.5 * rigidity * size**2 / radius**2, rel=0.15)


def test_rigid_motion_costs_nothing_and_modes_carry_none(block: Block) -> None:
    rigid = rigid_modes(block.points, block.masses)
    stiffness = tangent_stiffness(block.points, block.elements, block.points, YOUNG, POISSON)
    assert np.abs(stiffness @ rigid.reshape(6, -1).T).max() < 1e-6 * stiffness.diagonal().max()
    weighted = block.modes.shapes * block.masses[:, None]
    np.testing.assert_allclose(np.einsum("kni,lni->kl", weighted, block.modes.shapes), np.eye(12), atol=1e-9)
    np.testing.assert_allclose(np.einsum("kni,lni->kl", weighted, rigid), 0.0, atol=1e-9)


def test_modes_diagonalise_the_stiffness(block: Block) -> None:
    stiffness = tangent_stiffness(block.points, block.elements, block.points, YOUNG, POISSON)
    flat = block.modes.shapes.reshape(12, -1)
    found = flat @ (stiffness @ flat.T)
    np.testing.assert_allclose(found, np.diag(block.modes.eigenvalues), atol=1e-6 * block.modes.eigenvalues.max())
    assert (np.diff(block.modes.eigenvalues) >= 0.0).all()
