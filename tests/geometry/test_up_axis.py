"""One rule for the axis that points up: that of the file, else a guess, else z."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from fuzz.gltf_files import Gltf

from odeform import cli
from odeform.formats.reading import read_geometry
from odeform.formats.writing import write_motion, write_shape
from odeform.geometry.shape import fit_to
from odeform.geometry.upright import stand_up, up_axis, up_of_rotation
from odeform.models.base import Predictor
from odeform.types import Mesh
from odeform_viz.fitting import shape_from

TIMES = np.array([0.0, 0.1, 0.2])


@pytest.fixture
def tall(tmp_path: Path) -> Path:
    """Two units high along y."""
    return Gltf().glb(tmp_path / "tall.glb")


def _table() -> Mesh:
    """A table on legs, y up."""
    boxes = [([0.1, 0.8, 0.1], [x, 0.4, z]) for x in (-0.5, 0.5) for z in (-0.2, 0.2)]
    boxes.append(([1.1, 0.1, 0.7], [0.0, 0.85, 0.0]))
    parts = [trimesh.creation.box(e, trimesh.transformations.translation_matrix(c)) for e, c in boxes]
    whole = trimesh.util.concatenate(parts)
    return Mesh(np.asarray(whole.vertices, np.float32), np.asarray(whole.faces, np.int32))


def test_what_a_file_says_comes_before_a_guess() -> None:
    plain = _table()
    assert up_axis(plain) == ("+y", "**y was taken for up**, a guess: the shape stands better on it")
    assert up_axis(Mesh(plain.points, plain.faces, up="+z")) == ("+z", "")
    assert up_axis(Mesh(plain.points, plain.faces, up="-x"))[0] == "-x"


@pytest.mark.parametrize("up", ["+x", "-x", "+y", "-y", "-z"])
def test_a_shape_stands_up(up: str) -> None:
    axis = "xyz".index(up[1])
    points = np.zeros((3, 3))
    points[1, axis], points[2, axis - 1] = (1.0 if up[0] == "+" else -1.0), 0.3
    mesh = Mesh(points, np.array([[0, 1, 2]]), up=up)
    stood = stand_up(mesh)
    np.testing.assert_allclose(stood.points[1], [0, 0, 1], atol=1e-7)
    assert stood.up == ""
    assert up_of_rotation(fit_to(mesh, stood).transform.rotation) == up


def test_command_line_viewer_and_python_agree(tall: Path, kick: Predictor, tmp_path: Path) -> None:
    shape = read_geometry(tall)
    fit = fit_to(shape, kick.rest)
    np.testing.assert_array_equal(shape_from(tall, kick.rest).geometry.points, fit.geometry.points)
    assert shape_from(tall, kick.rest).upright == fit.upright
    assert np.ptp(fit.geometry.points, axis=0).argmax() == 2
    out = tmp_path / "a.npz"
    assert cli.main(["predict", "kick", "--geometry", str(tall), "--times", "0:0.3:0.1", "--out", str(out)]) == 0
    with np.load(out) as arrays:
        motion = kick.solve(fit.geometry)
        back = fit.transform.inverse
        np.testing.assert_allclose(arrays["vertices"][1], back.points(motion.vertices(0.1)), atol=1e-4)


def test_a_drop_falls_along_the_axis_that_the_file_has_up(tall: Path, tmp_path: Path) -> None:
    out, film = tmp_path / "a.npz", tmp_path / "a.glb"
    for name in (out, film, tmp_path / "{frame}.glb"):
        given = ["predict", "mass-elastic/pod-rbf", "--geometry", str(tall), "--times", "0:0.21:0.1"]
        assert cli.main([*given, "--out", str(name)]) == 0
    with np.load(out) as arrays:
        moved = (arrays["vertices"][2] - arrays["vertices"][0]).mean(axis=0)
    assert np.abs(moved).argmax() == 1
    assert moved[1] < 0.0
    for name in (film, tmp_path / "00000.glb", tmp_path / "00002.glb"):
        np.testing.assert_allclose(np.ptp(read_geometry(name).points, axis=0), [1, 2, 1], rtol=0.05)


def test_a_shape_that_is_not_fitted_is_turned_too(tall: Path, kick: Predictor, tmp_path: Path) -> None:
    """`read_geometry` and `solve` alone: the motion is that of the scene, in which z is up."""
    motion = kick.solve(read_geometry(tall))
    np.testing.assert_allclose(np.ptp(motion.vertices(0.0), axis=0), [1, 1, 2], rtol=1e-5)
    write_motion(motion, TIMES, tmp_path / "a.glb")
    write_motion(motion, TIMES[:1], tmp_path / "b.glb")
    for name in ("a.glb", "b.glb"):
        np.testing.assert_allclose(np.ptp(read_geometry(tmp_path / name).points, axis=0), [1, 2, 1], rtol=1e-4)


def test_writing_glb_is_the_inverse_of_reading_it(tall: Path, tmp_path: Path) -> None:
    shape = read_geometry(tall)
    write_shape(shape, tmp_path / "same.glb")
    np.testing.assert_array_equal(read_geometry(tmp_path / "same.glb").points, shape.points)
    upright = stand_up(shape)
    write_shape(upright, tmp_path / "turned.glb")
    np.testing.assert_allclose(read_geometry(tmp_path / "turned.glb").points, shape.points, atol=1e-7)


def test_a_guess_is_said(kick: Predictor, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_shape(_table(), tmp_path / "table.obj")
    given = ["predict", "kick", "--geometry", str(tmp_path / "table.obj"), "--times", "0:0.1:0.1"]
    assert cli.main([*given, "--out", str(tmp_path / "a.npz")]) == 0
    assert "table.obj: y was taken for up, a guess" in capsys.readouterr().err
