"""The lists of formats, and what follows from a line in them."""

import json
from pathlib import Path
from typing import IO

import numpy as np
import pytest

from odeform.errors import InputError
from odeform.formats import registry
from odeform.formats.reading import read_geometry
from odeform.formats.registry import READERS, WRITERS, Reader, Writer, load_function
from odeform.formats.writing import write_motion, write_shape
from odeform.geometry.primitives import octasphere
from odeform.geometry.shape import FittedShape
from odeform.models.base import Predictor
from odeform.motion.base import Motion
from odeform.types import Floats, GaussianSplats, Geometry, Mesh, PointCloud

BALL = octasphere(0.1, 3)


def read_json(path: Path, merge: bool) -> PointCloud:
    return PointCloud(np.array(json.loads(path.read_text())))


def json_shape(geometry: Geometry, path: Path) -> bytes:
    return json.dumps(geometry.points.tolist()).encode()


def json_motion(file: IO[bytes], motion: Motion, times: Floats, fit: FittedShape | None) -> None:
    file.write(json.dumps(motion.vertices(times).tolist()).encode())


@pytest.fixture
def with_json(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(READERS, ".json", Reader("points as JSON", f"{__name__}:read_json"))
    monkeypatch.setitem(WRITERS, ".json", Writer("points as JSON", f"{__name__}:json_shape", f"{__name__}:json_motion"))


TARGETS = {r.read for r in READERS.values()} | {target for w in WRITERS.values() for target in (w.shape, w.motion)}


@pytest.mark.parametrize("target", sorted(TARGETS - {""}))
def test_every_target_is_a_function(target: str) -> None:
    assert callable(load_function(target))


@pytest.mark.usefixtures("with_json")
def test_a_line_is_a_format(kick: Predictor, tmp_path: Path) -> None:
    write_shape(BALL, tmp_path / "ball.JSON")
    assert np.allclose(read_geometry(tmp_path / "ball.JSON").points, BALL.points)
    motion, times = kick.solve(), np.array([0.0, 0.2])
    write_motion(motion, times, tmp_path / "all.json")
    write_motion(motion, times, tmp_path / "{frame}.json")
    frames = np.array(json.loads((tmp_path / "all.json").read_text()))
    for frame in range(2):
        assert np.allclose(read_geometry(tmp_path / f"0000{frame}.json").points, frames[frame], atol=1e-6)
    assert ".json" in registry.shape_formats()
    assert ".json" in registry.motion_formats()


def test_endings_as_text() -> None:
    whole = ".csv, .glb, .npz, .webp, .html or .rrd"
    by_frame = ".ply, .obj, .stl or .glb with {frame} in the name (one file per frame)"
    assert registry.motion_endings() == f"{whole}, or {by_frame}"


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".stl", ".glb"])
def test_shapes_round_trip(tmp_path: Path, suffix: str) -> None:
    write_shape(BALL, tmp_path / f"ball{suffix}")
    mesh = read_geometry(tmp_path / f"ball{suffix}")
    assert isinstance(mesh, Mesh)
    assert mesh.faces.shape == BALL.faces.shape
    order, true = np.lexsort(np.round(mesh.points, 5).T), np.lexsort(np.round(BALL.points, 5).T)
    assert np.allclose(mesh.points[order], BALL.points[true], atol=1e-6)


def test_only_meshes_in_mesh_formats(tmp_path: Path) -> None:
    splats = GaussianSplats(np.eye(3), np.tile(np.eye(3), (3, 1, 1)), np.zeros((3, 1, 3)), np.ones(3))
    with pytest.raises(InputError, match="holds meshes only, got a GaussianSplats"):
        write_shape(splats, tmp_path / "a.obj")
    assert not list(tmp_path.iterdir())
    write_shape(splats, tmp_path / "a.ply")
    assert isinstance(read_geometry(tmp_path / "a.ply"), GaussianSplats)


def test_unknown_endings(kick: Predictor, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"expected a name ending in one of .ply, .obj, .stl, .glb"):
        write_shape(BALL, tmp_path / "ball.npz")
    motion = kick.solve()
    for name in ("motion.mp4", "motion.ply", "motion"):
        with pytest.raises(InputError, match=r"expected a name ending in .csv, .glb, .npz, .webp, .html or .rrd"):
            write_motion(motion, np.array([0.0]), tmp_path / name)
    (tmp_path / "shape").write_text("anything")
    with pytest.raises(InputError, match=r"expected one of .*\.glb, .* got no ending"):
        read_geometry(tmp_path / "shape")
