"""Solids inside of shapes with every defect."""

from collections.abc import Callable

import numpy as np
import pytest
import trimesh

from odeform.errors import InputError
from odeform.geometry.solids.solid import solid_inside
from odeform.geometry.solids.tetrahedra import qualities, volumes
from odeform.types import Geometry, Mesh, PointCloud


def mesh_of(*shapes: trimesh.Trimesh) -> Mesh:
    shape = trimesh.util.concatenate(shapes)
    return Mesh(np.asarray(shape.vertices, dtype=float), np.asarray(shape.faces, dtype=np.int32))


def ball(radius: float = 1.0, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> trimesh.Trimesh:
    return trimesh.creation.icosphere(4, radius).apply_translation(at)


def kept(shape: trimesh.Trimesh, faces: np.ndarray) -> trimesh.Trimesh:
    return trimesh.Trimesh(shape.vertices, shape.faces[faces], process=False)


def turned(shape: trimesh.Trimesh, faces: np.ndarray) -> trimesh.Trimesh:
    return trimesh.Trimesh(shape.vertices, np.where(faces[:, None], shape.faces[:, ::-1], shape.faces), process=False)


def torn() -> Mesh:
    return mesh_of(kept(ball(), np.random.default_rng(0).random(5120) > 0.1))


def flipped() -> Mesh:
    return mesh_of(turned(ball(), np.random.default_rng(0).random(5120) > 0.5))


def soup() -> Mesh:
    return Mesh(np.asarray(ball().triangles).reshape(-1, 3), np.arange(3 * 5120).reshape(-1, 3))


def open_box() -> Mesh:
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    return mesh_of(kept(box, box.face_normals[:, 2] < 0.5))


def half() -> Mesh:
    return mesh_of(kept(ball(), ball().triangles_center[:, 2] < 0.0))


def hollow() -> Mesh:
    return mesh_of(ball(), turned(ball(0.8), np.ones(5120, dtype=bool)))


def overlapping() -> Mesh:
    return mesh_of(ball(), ball(0.7, (1.0, 0.0, 0.0)))


BALL = 4.0 / 3.0 * np.pi
SHAPES: dict[str, tuple[Callable[[], Geometry], float, int]] = {
    "torn": (torn, BALL, 2),
    "flipped": (flipped, BALL, 2),
    "soup": (soup, BALL, 2),
    "open box": (open_box, 1.0, 2),
    "half": (half, 0.5 * BALL, 2),
    "hollow": (hollow, BALL * (1.0 - 0.8**3), 4),
    "ring": (lambda: mesh_of(trimesh.creation.torus(1.0, 0.2)), 2.0 * np.pi**2 * 0.04, 0),
    "cloud": (lambda: PointCloud(np.asarray(trimesh.creation.icosphere(5).vertices)), BALL, 2),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SHAPES)
def test_a_shape_with_defects_becomes_a_closed_solid_of_its_volume(name: str) -> None:
    make, volume, euler = SHAPES[name]
    found = solid_inside(make())
    surface = trimesh.Trimesh(found.points, found.faces, process=False)
    assert surface.is_watertight
    assert surface.euler_number == euler
    assert surface.volume == pytest.approx(volume, rel=0.1)
    assert volumes(found.points, found.elements).sum() == pytest.approx(surface.volume)
    assert qualities(found.points, found.elements).min() > 0.1
    assert 500 < len(found.points) < 2500
    assert set(np.unique(found.faces)) == set(range(found.faces.max() + 1))


@pytest.mark.slow
def test_walls_thinner_than_the_tetrahedra_survive_and_it_is_said() -> None:
    thin = solid_inside(mesh_of(trimesh.creation.box((1.0, 0.7, 0.015))))
    surface = trimesh.Trimesh(thin.points, thin.faces, process=False)
    assert surface.is_watertight
    assert surface.euler_number == 2
    assert surface.extents == pytest.approx([1.0, 0.7, 0.015], abs=0.03)
    assert thin.changes.volume > 1.0
    assert "volume +" in thin.changes.describe(1.0)


@pytest.mark.slow
def test_what_was_done_is_said() -> None:
    speck = ball(0.005, (1.5, 0.0, 0.0))
    changes = solid_inside(mesh_of(kept(ball(), np.arange(5120) >= 40), speck)).changes
    assert "1 hole closed, the widest" in changes.describe(1.0)
    assert "1 loose speck" in changes.describe(1.0)
    inward = solid_inside(mesh_of(turned(trimesh.creation.box(), np.ones(12, dtype=bool))))
    assert "its faces look inward" in inward.changes.describe(1.0)


def sheet() -> Mesh:
    x, y = np.meshgrid(np.linspace(0, 1, 8), np.linspace(0, 1, 8))
    plane = np.stack([x.ravel(), y.ravel(), 0.1 * np.sin(3 * x.ravel())], axis=1)
    quads = np.array([[i, i + 1, i + 9, i + 8] for i in range(56) if i % 8 != 7])
    return Mesh(plane, np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]))


def spoilt() -> Mesh:
    mesh = mesh_of(ball())
    mesh.points[3] = np.nan
    return mesh


NOISE = np.random.default_rng(0).normal(size=(6000, 3))


@pytest.mark.parametrize(
    ("shape", "reason"),
    [
        (lambda: Mesh(np.eye(3), np.array([[0, 1, 2]])), "at least 4 triangles"),
        (lambda: Mesh(ball().vertices * [1.0, 1.0, 0.0], ball().faces), "encloses no volume: it is flat"),
        (sheet, "encloses no volume: it is open"),
        (lambda: mesh_of(ball(), ball(1.0, (3.0, 0.0, 0.0))), "2 separate bodies"),
        (spoilt, "not finite"),
        (lambda: PointCloud(NOISE * [1.0, 1.0, 0.0]), "enclose no volume"),
        (lambda: PointCloud(NOISE[:50]), "at least 300 points"),
        (lambda: PointCloud(np.random.default_rng(0).normal(size=(20_000, 3))), "as fog does"),
        (lambda: PointCloud(np.random.default_rng(0).uniform(size=(2_000, 3))), "as fog does"),
    ],
    ids=["triangle", "flat", "sheet", "two", "nan", "plane", "few", "fog", "thin fog"],
)
def test_what_is_no_solid_is_refused_with_the_reason(shape: Callable[[], Geometry], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        solid_inside(shape())


@pytest.mark.slow
def test_a_soup_whose_triangles_look_every_way_counts_as_points() -> None:
    rng = np.random.default_rng(0)
    corners = np.asarray(ball().triangles)[rng.random(5120) > 0.1]
    turned_ones = rng.random(len(corners)) > 0.6
    corners[turned_ones] = corners[turned_ones][:, ::-1]
    corners = corners + 3e-3 * rng.standard_normal(corners.shape)  # no vertex is shared
    found = solid_inside(Mesh(corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(-1, 3)))
    surface = trimesh.Trimesh(found.points, found.faces, process=False)
    assert surface.is_watertight
    assert surface.volume == pytest.approx(BALL, rel=0.1)
    assert "its triangles look every way, and count as points" in found.changes.describe(1.0)


@pytest.mark.slow
def test_a_soup_that_looks_outward_keeps_its_sides() -> None:
    corners = np.asarray(ball().triangles)
    corners = corners + 1e-3 * np.random.default_rng(0).standard_normal(corners.shape)
    found = solid_inside(Mesh(corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(-1, 3)))
    assert volumes(found.points, found.elements).sum() == pytest.approx(BALL, rel=0.05)
    assert "look every way" not in found.changes.describe(1.0)


@pytest.mark.slow
def test_a_room_is_filled_and_it_is_said() -> None:
    walls = trimesh.creation.box((4.0, 5.0, 2.5)).subdivide()
    room = mesh_of(turned(walls, np.ones(len(walls.faces), dtype=bool)), ball(0.3))
    found = solid_inside(room)
    assert volumes(found.points, found.elements).sum() == pytest.approx(50.0, rel=0.02)
    assert "as those of a room do" in found.changes.describe(1.0)
