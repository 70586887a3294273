"""Reading shapes from files. Every file is validated here, once; anything wrong raises `InputError`."""

from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from odeform.errors import InputError
from odeform.types import Floats, GaussianSplats, Geometry, Mesh, PointCloud

__all__ = ["read_geometry"]

SH0 = 0.28209479177387814  # zeroth real spherical harmonic
MESHES = (".obj", ".ply", ".stl", ".glb", ".gltf", ".off")
SPLAT_FIELDS = ("opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3")


def read_geometry(path: str | Path) -> Geometry:
    """A mesh (.obj .ply .stl .glb .off), points (.ply .xyz), or Gaussian splats (.splat, INRIA .ply)."""
    path = Path(path)
    if not path.is_file():
        raise InputError(f"geometry {path}: no such file")
    suffix = path.suffix.lower()
    try:
        if suffix == ".splat":
            geometry: Geometry = _splat(path.read_bytes(), path)
        elif suffix == ".xyz":
            geometry = PointCloud(np.loadtxt(path, ndmin=2)[:, [0, 1, 2]])
        elif suffix in MESHES:
            geometry = _from_trimesh(path)
        else:
            expected = ", ".join([*MESHES, ".splat", ".xyz"])
            raise InputError(f"geometry {path}: expected one of {expected}, got {suffix or 'no ending'}")
    except InputError:
        raise
    except Exception as error:
        # the parsers behind this raise whatever a broken file makes them trip over
        raise InputError(f"geometry {path}: cannot be read as {suffix}: {error}") from None
    return _validated(geometry, path)


def _validated(geometry: Geometry, path: Path) -> Geometry:
    points = geometry.points
    if len(points) < 2:
        raise InputError(f"geometry {path}: expected at least 2 points, got {len(points)}")
    numbers = [np.reshape(x, (len(points), -1)) for name, x in vars(geometry).items() if name != "faces"]
    bad = int((~np.isfinite(np.concatenate(numbers, axis=1)).all(axis=1)).sum())
    if bad:
        raise InputError(f"geometry {path}: {bad} of {len(points)} points are not finite")
    if np.ptp(points, axis=0).max() <= 0.0:
        raise InputError(f"geometry {path}: all {len(points)} points coincide")
    if isinstance(geometry, Mesh):
        if len(geometry.faces) == 0:
            raise InputError(f"geometry {path}: a mesh without faces")
        if geometry.faces.min() < 0 or geometry.faces.max() >= len(points):
            raise InputError(f"geometry {path}: faces refer to vertices that do not exist")
    return geometry


def _from_trimesh(path: Path) -> Geometry:
    if path.suffix.lower() == ".ply":
        header = path.read_bytes()[:65536].split(b"end_header")[0]
        if b"packed_position" in header:
            raise InputError(f"geometry {path}: compressed splats are not supported; expected the uncompressed .ply")
    loaded: Any = trimesh.load(path, process=False)
    if isinstance(loaded, trimesh.Scene):
        if not loaded.geometry:
            raise InputError(f"geometry {path}: contains no mesh")
        loaded = loaded.to_geometry()
    raw = getattr(loaded, "metadata", {}).get("_ply_raw", {}).get("vertex", {}).get("data")
    names = getattr(getattr(raw, "dtype", None), "names", None) or ()
    if "f_dc_0" in names:
        return _inria(raw, names, path)
    if isinstance(loaded, trimesh.PointCloud):
        return PointCloud(np.asarray(loaded.vertices, dtype=np.float32))
    if np.isfinite(loaded.vertices).all():  # else it is refused below, by number
        loaded.merge_vertices(merge_tex=True, merge_norm=True)
    return Mesh(np.asarray(loaded.vertices, dtype=np.float32), np.asarray(loaded.faces, dtype=np.int32))


def _inria(raw: Any, names: tuple[str, ...], path: Path) -> GaussianSplats:
    missing = [name for name in SPLAT_FIELDS if name not in names]
    if missing:
        raise InputError(f"geometry {path}: splats without {', '.join(missing)}")

    def columns(*fields: str) -> Floats:
        return np.stack([raw[name] for name in fields], axis=1).astype(float)

    color = np.clip(0.5 + SH0 * columns("f_dc_0", "f_dc_1", "f_dc_2"), 0.0, 1.0)
    opacity = 1.0 / (1.0 + np.exp(-np.clip(raw["opacity"].astype(float), -30.0, 30.0)))
    scales = np.exp(np.clip(columns("scale_0", "scale_1", "scale_2"), -30.0, 10.0))
    return GaussianSplats(
        columns("x", "y", "z").astype(np.float32),
        _covariances(scales, columns("rot_0", "rot_1", "rot_2", "rot_3")),
        color,
        opacity,
    )


def _splat(data: bytes, path: Path) -> GaussianSplats:
    if len(data) == 0 or len(data) % 32:
        raise InputError(f"geometry {path}: expected 32 bytes a splat, got {len(data)} bytes")
    layout = np.dtype([("xyz", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("rot", "u1", 4)])
    raw = np.frombuffer(data, dtype=layout)
    rotation = (raw["rot"].astype(float) - 128.0) / 128.0
    rgba = raw["rgba"] / 255.0
    return GaussianSplats(
        raw["xyz"].copy(), _covariances(raw["scale"].astype(float), rotation), rgba[:, :3], rgba[:, 3]
    )


def _covariances(scales: Floats, quaternions: Floats) -> Floats:
    """(N, 3) standard deviations and (N, 4) quaternions, w first and of any length -> (N, 3, 3)."""
    length = np.linalg.norm(quaternions, axis=1, keepdims=True)
    unit = np.where(~(length <= 1e-12), quaternions / np.maximum(length, 1e-12), [1.0, 0.0, 0.0, 0.0])
    w, x, y, z = unit.T
    rotation = np.stack(
        [
            *(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            *(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            *(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        ],
        axis=1,
    ).reshape(-1, 3, 3)
    half = rotation * scales[:, None, :]
    return half @ half.swapaxes(1, 2)
