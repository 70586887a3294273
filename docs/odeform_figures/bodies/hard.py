"""Shapes as scans and models of others are, made by code: with every defect, and such as are no body at all."""

from collections.abc import Callable

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from odeform.types import SH0, Bools, GaussianSplats, Geometry, Mesh, PointCloud, Points
from odeform_figures.bodies.scan import scanned_shoe

__all__ = ["BAD", "HARD"]

Part = trimesh.Trimesh


def _ball(radius: float, at: tuple[float, float, float] = (0.0, 0.0, 0.0), detail: int = 3) -> Part:
    return trimesh.creation.icosphere(detail, radius).apply_translation(at)


def _box(*extents: float, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Part:
    return trimesh.creation.box(extents).subdivide().subdivide().apply_translation(at)


def _rod(radius: float, start: tuple[float, float, float], end: tuple[float, float, float]) -> Part:
    return trimesh.creation.cylinder(radius, segment=np.array([start, end]), sections=16)


def _cone(radius: float, height: float, at: tuple[float, float, float]) -> Part:
    return trimesh.creation.cone(radius, height, sections=16).apply_translation(at)


def _side(radius: float, low: float, high: float) -> Part:
    """The side of a cylinder alone, a sheet."""
    whole = trimesh.creation.cylinder(radius, high - low, sections=48).apply_translation((0.0, 0.0, 0.5 * (low + high)))
    return _only(whole, np.abs(whole.face_normals[:, 2]) < 0.5)


def _only(part: Part, kept: Bools) -> Part:
    return trimesh.Trimesh(part.vertices, part.faces[kept], process=False)


def _inward(part: Part) -> Part:
    return trimesh.Trimesh(part.vertices, part.faces[:, ::-1], process=False)


def _mesh(*parts: Part) -> Mesh:
    whole = trimesh.util.concatenate(parts)
    assert isinstance(whole, Part)
    return Mesh(np.asarray(whole.vertices, np.float32), np.asarray(whole.faces, np.int32), up="+z")


def _cloud(mesh: Mesh, count: int, noise: float) -> PointCloud:
    """Points on a mesh, off by `noise`, relative to its size."""
    shape = trimesh.Trimesh(mesh.points, mesh.faces, process=False)
    points = np.asarray(trimesh.sample.sample_surface(shape, count, seed=0)[0])
    spread = noise * float(np.ptp(points, axis=0).max())
    points = points + spread * np.random.default_rng(0).standard_normal(points.shape)
    return PointCloud(points.astype(np.float32), up="+z")


def _splats(points: Points, width: float) -> GaussianSplats:
    count = len(points)
    covariances = np.tile(width**2 * np.eye(3), (count, 1, 1)).astype(np.float32)
    harmonics = np.full((count, 1, 3), 0.2 / SH0, np.float32)
    opacities = np.full(count, 0.9, np.float32)
    return GaussianSplats(np.asarray(points, np.float32), covariances, harmonics, opacities, up="+z")


def _tipped(part: Part, axis: tuple[float, float, float]) -> Part:
    """A quarter turn about an axis."""
    return part.apply_transform(trimesh.transformations.rotation_matrix(0.5 * np.pi, axis))


def _horse(leg: float = 0.011) -> Mesh:
    legs = [_rod(leg, (x, y, 0.0), (0.9 * x, 0.8 * y, 0.16)) for x in (-0.09, 0.09) for y in (-0.03, 0.03)]
    trunk = _tipped(trimesh.creation.capsule(0.2, 0.045), (0.0, 1.0, 0.0)).apply_translation((0.0, 0.0, 0.19))
    neck, head = _rod(0.022, (0.09, 0.0, 0.2), (0.15, 0.0, 0.29)), _rod(0.02, (0.14, 0.0, 0.29), (0.21, 0.0, 0.26))
    tail = _rod(0.006, (-0.13, 0.0, 0.2), (-0.18, 0.0, 0.1))
    return _mesh(*legs, trunk, neck, head, tail)


def _dragon() -> Mesh:
    bends = np.linspace(0.0, 1.0, 40)
    path = np.stack([0.28 * bends - 0.14, 0.04 * np.sin(7.0 * bends), 0.05 + 0.05 * np.sin(4.0 * bends)], axis=1)
    width = 0.012 + 0.03 * np.sin(np.pi * bends) ** 1.5
    trunk = [_ball(w, tuple(p), 2) for p, w in zip(path, width, strict=True)]
    spikes = [_cone(0.006, 0.03, (x, y, z + 0.8 * w)) for (x, y, z), w in zip(path[4:-4:3], width[4:-4:3], strict=True)]
    feet = [_rod(0.012, (x, y, 0.0), (x, 0.3 * y, 0.06)) for x in (-0.05, 0.06) for y in (-0.05, 0.05)]
    wings = [_box(0.08, 0.1, 0.002, at=(0.0, y, 0.12)) for y in (-0.06, 0.06)]
    return _mesh(*trunk, *spikes, *feet, *wings)


def _duck() -> Mesh:
    body = _ball(1.0, detail=4)
    body.apply_scale([0.06, 0.045, 0.04])
    body = _only(body, body.triangles_center[:, 2] > -0.032)  # what lay on the table was not seen
    return _mesh(body, _ball(0.026, (0.045, 0.0, 0.055)), _cone(0.012, 0.03, (0.075, 0.0, 0.05)))


def _bottle() -> Mesh:
    """Seven parts that overlap, or only touch."""
    label = _side(0.0365, 0.03, 0.09)
    return _mesh(
        trimesh.creation.cylinder(0.036, 0.12, sections=48).apply_translation((0, 0, 0.06)),
        _cone(0.036, 0.05, (0.0, 0.0, 0.12)),
        trimesh.creation.cylinder(0.012, 0.04, sections=32).apply_translation((0, 0, 0.155)),
        trimesh.creation.cylinder(0.015, 0.02, sections=32).apply_translation((0, 0, 0.18)),
        trimesh.creation.torus(0.033, 0.004).apply_translation((0, 0, 0.004)),
        label,
        trimesh.creation.cylinder(0.03, 0.07, sections=32).apply_translation((0, 0, 0.045)),  # what is in it
    )


def _boot() -> Mesh:
    """A shell of 4 mm, open at the top."""
    leg = trimesh.creation.annulus(0.038, 0.042, 0.16, sections=48).apply_translation((-0.06, 0.0, 0.12))
    foot = _ball(1.0, detail=4)
    foot.apply_scale([0.11, 0.045, 0.05])
    inner = _inward(foot.copy().apply_scale(0.92))
    cut = foot.copy().apply_translation((0.0, 0.0, 0.05))
    return _mesh(leg, cut, inner.apply_translation((0.0, 0.0, 0.05)), _box(0.2, 0.08, 0.012, at=(0.0, 0.0, 0.006)))


def _crossing() -> Mesh:
    """A knot whose tube is so thick that it runs through itself."""
    turn = np.linspace(0.0, 2.0 * np.pi, 161)
    radius = 0.06 + 0.03 * np.cos(1.5 * 2.0 * turn)
    path = np.stack([radius * np.cos(2 * turn), radius * np.sin(2 * turn), 0.03 * np.sin(3 * turn)], axis=1)
    return _mesh(*[_rod(0.028, tuple(one), tuple(other)) for one, other in zip(path[:-4:4], path[4::4], strict=True)])


def _walled() -> Mesh:
    """A box with a wall within, and a fin of one sheet: edges with three faces."""
    box = _box(0.1, 0.1, 0.1)
    wall, fin = (_sheet(0.1), _sheet(0.03).apply_translation((0.065, 0.0, 0.0)))
    return _mesh(box, wall, fin)


def _sheet(width: float, height: float = 0.1, count: int = 12) -> Part:
    x, z = np.meshgrid(np.linspace(-0.5, 0.5, count) * width, np.linspace(-0.5, 0.5, count) * height)
    points = np.stack([x.ravel(), np.zeros(x.size), z.ravel()], axis=1)
    at = np.arange(count * count).reshape(count, count)
    a, b, c, d = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel(), at[1:, :-1].ravel()
    return trimesh.Trimesh(points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]), process=False)


def _berry() -> Mesh:
    """Three hundred small balls that overlap."""
    at = np.asarray(trimesh.creation.icosphere(3, 0.05).vertices)[::2]
    return _mesh(_ball(0.046), *[_ball(0.007, tuple(one), 1) for one in at])


def _frame() -> Mesh:
    """The edges of a cube, as thin rods."""
    corners = 0.06 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    pairs = [(a, b) for a in range(8) for b in range(a) if np.isclose(np.linalg.norm(corners[a] - corners[b]), 0.12)]
    rods = [_rod(0.007, tuple(corners[a]), tuple(corners[b])) for a, b in pairs]
    return _mesh(*rods, *[_ball(0.007, tuple(corner), 2) for corner in corners])


def _chair() -> Mesh:
    legs = [_rod(0.008, (x, y, 0.0), (x, y, 0.12)) for x in (-0.05, 0.05) for y in (-0.05, 0.05)]
    return _mesh(*legs, _box(0.13, 0.13, 0.012, at=(0, 0, 0.12)), _box(0.012, 0.13, 0.12, at=(-0.06, 0, 0.18)))


def _mug() -> Mesh:
    handle = _tipped(trimesh.creation.torus(0.028, 0.005), (1.0, 0.0, 0.0)).apply_translation((0.045, 0.0, 0.0))
    bottom = trimesh.creation.cylinder(0.04, 0.004, sections=64).apply_translation((0.0, 0.0, -0.048))
    return _mesh(trimesh.creation.annulus(0.037, 0.040, 0.1, sections=64), bottom, handle)


def _cup() -> Mesh:
    """The side and the bottom of a cylinder, of one sheet."""
    whole = trimesh.creation.cylinder(0.04, 0.1, sections=48)
    return _mesh(_only(whole, whole.face_normals[:, 2] < 0.5))


def _spoilt() -> Mesh:
    """A soup of triangles: a tenth is gone, some are doubled, flat, or turned."""
    rng = np.random.default_rng(0)
    corners = np.asarray(_ball(0.06, detail=4).triangles)
    corners = corners[rng.random(len(corners)) > 0.1]
    turned = rng.random(len(corners)) > 0.7
    corners[turned] = corners[turned][:, ::-1]
    corners = np.concatenate([corners, corners[:200], np.repeat(corners[:50, :1], 3, axis=1)])
    corners = corners + 2e-4 * rng.standard_normal(corners.shape)
    return Mesh(corners.reshape(-1, 3).astype(np.float32), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3))


def _floaters() -> GaussianSplats:
    """Splats on a ring, and some in the air around it."""
    ring = _cloud(_mesh(trimesh.creation.torus(0.06, 0.025)), 12_000, 0.004).points
    stray = np.random.default_rng(1).uniform(-0.2, 0.2, (150, 3))
    return _splats(np.concatenate([ring, stray]), 0.002)


def _half_seen() -> PointCloud:
    """A scan of a ball from one side: the other half, and what it stands on, are missing."""
    points = np.asarray(trimesh.creation.icosphere(5, 0.05).vertices)
    return PointCloud(points[points[:, 2] > -0.01].astype(np.float32))


HARD: dict[str, Callable[[], Geometry]] = {
    "sneaker, open below, noisy": scanned_shoe,
    "boot, a shell of 4 mm": _boot,
    "horse on thin legs": _horse,
    "horse on thinner legs": lambda: _horse(0.006),
    "dragon of 60 parts": _dragon,
    "duck, open below": _duck,
    "open tube of one sheet": lambda: _mesh(_side(0.03, 0.0, 0.15)),
    "tube with a wall": lambda: _mesh(trimesh.creation.annulus(0.025, 0.03, 0.15, sections=48)),
    "cup of one sheet": _cup,
    "mug with a handle": _mug,
    "bottle of seven parts": _bottle,
    "can": lambda: _mesh(trimesh.creation.cylinder(0.033, 0.12, sections=12)),
    "soap brick": lambda: _mesh(_box(0.1, 0.06, 0.02)),
    "flat soap": lambda: _mesh(_box(0.1, 0.06, 0.005)),
    "non-manifold: wall and fin": _walled,
    "self-intersecting knot": _crossing,
    "ring, faces inward": lambda: _mesh(_inward(trimesh.creation.torus(0.06, 0.02))),
    "berry of 320 parts": _berry,
    "frame of rods": _frame,
    "chair": _chair,
    "soup of triangles": _spoilt,
    "cloud of a horse, noise 0.5 %": lambda: _cloud(_horse(0.014), 20_000, 0.005),
    "cloud of a brick, noise 1 %": lambda: _cloud(_mesh(_box(0.1, 0.06, 0.04)), 8_000, 0.01),
    "cloud of a ball, seen from one side": _half_seen,
    "splats of a ring, with floaters": _floaters,
}
"""Bodies: each should become a solid that stands and moves."""


def _room(furnished: bool = False, open_: bool = False) -> Mesh:
    walls = _inward(_box(4.0, 5.0, 2.5, at=(0.0, 0.0, 1.25)))
    if open_:
        walls = _only(walls, walls.triangles_center[:, 2] < 2.49)
    parts = [_box(1.0, 0.6, 0.7, at=(1.0, 1.0, 0.4)), _ball(0.3, (-1.0, -1.0, 0.5))] if furnished else []
    return _mesh(walls, *parts)


def _room_cloud() -> PointCloud:
    return _cloud(_room(True, True), 40_000, 0.001)


def _scene() -> GaussianSplats:
    """A floor, and a ball and a box on it."""
    rng = np.random.default_rng(0)
    floor = np.concatenate([rng.uniform(-1.0, 1.0, (20_000, 2)), 0.005 * rng.standard_normal((20_000, 1))], axis=1)
    things = _cloud(_mesh(_ball(0.15, (0.3, 0.0, 0.15)), _box(0.3, 0.2, 0.2, at=(-0.4, 0.0, 0.1))), 15_000, 0.0).points
    return _splats(np.concatenate([floor, things]), 0.01)


def _waved() -> Mesh:
    part = _sheet(0.3, 0.3, 40)
    points = np.asarray(part.vertices)
    points[:, 1] += 0.01 * np.sin(40.0 * points[:, 0]) + 0.01 * np.cos(30.0 * points[:, 2])
    return Mesh(points[:, [0, 2, 1]].astype(np.float32), np.asarray(part.faces, np.int32))


def _tapered(size: float) -> Mesh:
    return _mesh(_ball(0.5 * size, detail=4), _cone(0.3 * size, size, (0.0, 0.0, 0.2 * size)))


def _dish() -> Mesh:
    """Half of a ball: its hole is as wide as it is."""
    whole = _ball(0.06, detail=4)
    return _mesh(_only(whole, whole.triangles_center[:, 2] < 0.0))


def _cap() -> Mesh:
    """A shallow part of a ball."""
    whole = _ball(0.06, detail=5)
    return _mesh(_only(whole, whole.triangles_center[:, 2] < -0.045))


def _turned_apart() -> Mesh:
    """Two bodies of one size, one on its side."""
    other = _box(0.1, 0.06, 0.05, at=(0.2, 0.0, 0.0))
    other.apply_transform(np.block([[Rotation.from_euler("x", 0.4).as_matrix(), np.zeros((3, 1))], [np.zeros(3), 1.0]]))
    return _mesh(_ball(0.05), other)


BAD: dict[str, Callable[[], Geometry]] = {
    "plane": lambda: _mesh(_sheet(0.3, 0.3, 30)),
    "waved plane": _waved,
    "cloud of a waved plane": lambda: _cloud(_waved(), 20_000, 0.002),
    "room, faces inward": _room,
    "room with furniture": lambda: _room(True),
    "room without a ceiling": lambda: _room(True, True),
    "cloud of a room": _room_cloud,
    "two bodies": _turned_apart,
    "cloud of two bodies": lambda: _cloud(_turned_apart(), 20_000, 0.001),
    "20 m large": lambda: _tapered(20.0),
    "hole as wide as the body": _dish,
    "shallow cap": _cap,
    "splats of fog": lambda: _splats(np.random.default_rng(0).normal(size=(60_000, 3)), 0.05),
    "splats of thin fog": lambda: _splats(np.random.default_rng(0).uniform(-1, 1, (2_000, 3)), 0.05),
    "splats of a scene": _scene,
    "points on a line": lambda: PointCloud(np.linspace([0, 0, 0], [1, 1, 1], 500).astype(np.float32)),
}
"""Such as are no body of one piece, or hardly: each should be moved or refused, with a line that says why."""
