"""Bending of curved shells, against the forces of MuJoCo."""

# MuJoCo is a compiled module without type stubs
# pyright: reportAttributeAccessIssue=false

from collections.abc import Callable

import mujoco
import numpy as np
import pytest
import trimesh

from odeform.mechanics.elasticity import elastic_modes, tangent_stiffness
from odeform.mechanics.hinges import hinge_stiffness
from odeform.simulation.flex import Contact, flex_xml
from odeform.simulation.objects.catalog import get_object
from odeform.types import Floats, Ints, Points

YOUNG, POISSON, THICKNESS = 1e6, 0.3, 0.002
STEP = 1e-6  # m, of differences


def simulated_force(
    points: Points, faces: Ints, young: float, poisson: float, thickness: float, kind: str
) -> Callable[[Points], Floats]:
    """Positions (N, 3) m -> elastic forces (N, 3) N of a shell in MuJoCo, whose `kind` is bend, stretch or both."""
    elasticity = f'young="{young}" poisson="{poisson}" thickness="{thickness}" elastic2d="{kind}"'
    xml = flex_xml(points, faces, 1.0, elasticity, Contact(0.5, 0.01), 1e-3, 0.0, floor=False)
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)

    def force(positions: Points) -> Floats:
        data.qpos[:] = (positions - points).ravel()
        mujoco.mj_forward(model, data)
        return data.qfrc_spring.reshape(-1, 3).copy()

    return force


def slope(force: Callable[[Points], Floats], positions: Points, way: Floats) -> Floats:
    """Minus the derivative of the force along `way` (N, 3), by differences of fourth order: exact for cubic forces."""

    def difference(step: float) -> Floats:
        return (force(positions + step * way) - force(positions - step * way)) / (2.0 * step)

    return -(4.0 * difference(STEP) - difference(2.0 * STEP)) / 3.0


def sheet(sag: float) -> tuple[Points, Ints]:
    """A saddle of irregular triangles, 0.1 m wide."""
    generator = np.random.default_rng(0)
    mesh = trimesh.creation.box((0.1, 0.1, 0.1)).subdivide().subdivide().subdivide()
    points, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    top = faces[(points[faces][:, :, 2] > 0.0499).all(axis=1)]
    kept, faces = np.unique(top, return_inverse=True)
    points = points[kept] + generator.uniform(-0.002, 0.002, (len(kept), 3)) * [1.0, 1.0, 0.0]
    x, y = points[:, 0], points[:, 1]
    points[:, 2] = sag * (x**2 - 2.0 * y**2 + 0.5 * x * y) / 0.05
    return points, faces.reshape(-1, 3)


def hinge_pull(points: Points, faces: Ints, positions: Points, way: Floats) -> Floats:
    """(N, 3) stiffness of the hinges at `positions`, times `way`."""
    blocks, corners = hinge_stiffness(points, faces, positions, YOUNG * THICKNESS**3 / (12.0 * (1.0 - POISSON**2)))
    pull = np.zeros_like(points)
    np.add.at(pull, corners, np.einsum("haibj,hbj->hai", blocks, way[corners]))
    return pull


@pytest.mark.parametrize("sag", [0.0, 0.6])
@pytest.mark.parametrize("deformed", [0.0, 2e-3])
def test_hinges_resist_as_simulated_ones_do(sag: float, deformed: float) -> None:
    points, faces = sheet(sag)
    generator = np.random.default_rng(1)
    positions, way = points + deformed * generator.normal(size=points.shape), generator.normal(size=points.shape)
    force = simulated_force(points, faces, YOUNG, POISSON, THICKNESS, "bend")
    expected = slope(force, positions, way)
    np.testing.assert_allclose(hinge_pull(points, faces, positions, way), expected, atol=1e-8 * np.abs(expected).max())
    # stiffness is linear in the positions, so its mean on the way from the origin gives the force itself
    found = -0.5 * (
        hinge_pull(points, faces, 0.0 * points, positions) + hinge_pull(points, faces, positions, positions)
    )
    np.testing.assert_allclose(found, force(positions), atol=1e-9)


@pytest.mark.parametrize("sag", [0.0, 0.6])
@pytest.mark.parametrize("deformed", [0.0, 2e-3])
def test_shells_resist_as_simulated_ones_do(sag: float, deformed: float) -> None:
    points, faces = sheet(sag)
    generator = np.random.default_rng(1)
    positions, way = points + deformed * generator.normal(size=points.shape), generator.normal(size=points.shape)
    stiffness = tangent_stiffness(points, faces, positions, YOUNG, POISSON, THICKNESS)
    expected = slope(simulated_force(points, faces, YOUNG, POISSON, THICKNESS, "both"), positions, way)
    np.testing.assert_allclose((stiffness @ way.ravel()).reshape(-1, 3), expected, atol=1e-8 * np.abs(expected).max())


def test_the_chip_vibrates_as_its_simulation_does() -> None:
    chip = get_object("chip")
    material = chip.material
    shell = material.young, material.poisson, material.thickness
    stiffness = tangent_stiffness(chip.points, chip.elements, chip.settled, *shell)
    modes = elastic_modes(stiffness, chip.masses, chip.settled, 6)
    assert np.sqrt(modes.eigenvalues[0]) / (2.0 * np.pi) == pytest.approx(32.37, abs=0.05)
    force = simulated_force(chip.points, chip.elements, *shell, "both")
    for square, shape in zip(modes.eigenvalues, modes.shapes, strict=True):
        pull = slope(force, chip.settled, shape)
        assert (shape * pull).sum() == pytest.approx(square, rel=1e-6)
        np.testing.assert_allclose(pull, square * chip.masses[:, None] * shape, atol=2e-2 * np.abs(pull).max())
