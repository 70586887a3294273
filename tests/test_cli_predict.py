"""`odeform predict`: what is written, and what is said of it."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

from odeform.formats.reading import read_geometry
from odeform.formats.splat_inria import inria_bytes
from odeform.geometry.shape import fit_to
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.types import GaussianSplats
from tests.commands import run


def test_predict_npz(
    trained: dict[str, Path], predictors: dict[str, Predictor], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "motion.npz"
    settings = ("--set", "mass=0.6", "azimuth=1.0", "--set", "force=100")
    assert run("predict", trained["odeform"], "--out", out, *settings, "--times", "0:1.5:0.1") == 0
    count = len(predictors["odeform"].rest.points)
    assert f"15 frames of {count:,} points" in capsys.readouterr().out
    motion = predictors["odeform"].solve(None, {"mass": 0.6, "azimuth": 1.0, "force": 100.0})
    with np.load(out, allow_pickle=False) as arrays:
        assert set(arrays) == {"times", "vertices", "faces", "parameters", "notes"}
        assert "4 of 15 frames are outside the trained window" in json.loads(str(arrays["notes"]))[0]
        assert arrays["vertices"].dtype == np.float32
        assert arrays["vertices"].shape == (15, count, 3)
        assert np.allclose(arrays["times"], np.arange(15) / 10.0)
        assert arrays["faces"].dtype == np.int32
        assert np.array_equal(arrays["faces"], motion.geometry.faces)  # pyright: ignore[reportAttributeAccessIssue]
        assert json.loads(str(arrays["parameters"])) == motion.parameters
        # frames asked for one at a time: they round otherwise than all at once
        np.testing.assert_allclose(arrays["vertices"], motion.vertices(arrays["times"]), rtol=0.0, atol=1e-6)
    assert list(tmp_path.iterdir()) == [out]


def test_predict_defaults_to_the_trained_frames(trained: dict[str, Path], tmp_path: Path) -> None:
    assert run("predict", trained["nearest"], "--out", tmp_path / "a.npz") == 0
    with np.load(tmp_path / "a.npz") as arrays:
        assert np.allclose(arrays["times"], np.arange(121) / 120.0)


def test_predict_ply(trained: dict[str, Path], predictors: dict[str, Predictor], tmp_path: Path) -> None:
    out = tmp_path / "frames" / "ball_{frame}.ply"
    out.parent.mkdir()
    assert run("predict", trained["odeform"], "--out", out, "--times", "0:0.3:0.1") == 0
    files = sorted(out.parent.iterdir())
    assert [file.name for file in files] == ["ball_00000.ply", "ball_00001.ply", "ball_00002.ply"]
    mesh = trimesh.load_mesh(files[2], process=False)
    motion = predictors["odeform"].solve()
    assert np.allclose(mesh.vertices, motion.vertices(0.2), atol=1e-6)
    assert np.array_equal(mesh.faces, motion.geometry.faces)  # pyright: ignore[reportAttributeAccessIssue]


def test_predict_fits_a_foreign_shape(trained: dict[str, Path], tmp_path: Path) -> None:
    box = trimesh.creation.box((2.0, 1.0, 1.0))
    box.apply_translation([50.0, 3.0, -7.0])
    box.export(tmp_path / "box.obj")
    out = tmp_path / "box.npz"
    assert run("predict", trained["odeform"], "--geometry", tmp_path / "box.obj", "--out", out) == 0
    with np.load(out) as arrays:
        # in the units and the place of the file: a tenth of it was moved
        assert np.allclose(arrays["vertices"][0], read_geometry(tmp_path / "box.obj").points, atol=2e-5)
        motion = load(trained["odeform"]).solve(fit_to(read_geometry(tmp_path / "box.obj"), load("kick").rest).geometry)
        shift = motion.vertices(arrays["times"][-1]).mean(axis=0) - motion.vertices(0.0).mean(axis=0)
        assert np.allclose((arrays["vertices"][-1] - arrays["vertices"][0]).mean(axis=0), 10.0 * shift, atol=1e-3)


def test_predict_takes_splats_and_tells_what_it_left_out(
    trained: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    points = np.random.default_rng(0).normal(size=(9, 3))
    points[4] = np.nan
    splats = GaussianSplats(points, np.tile(1e-4 * np.eye(3), (9, 1, 1)), np.zeros((9, 4, 3)), np.ones(9))
    (tmp_path / "nine.ply").write_bytes(inria_bytes(splats))
    arguments = ("--geometry", tmp_path / "nine.ply", "--out", tmp_path / "{frame}.ply", "--times", "0:0.2:0.1")
    assert run("predict", trained["nearest"], *arguments) == 0
    said = capsys.readouterr()
    left_out, foreign = said.err.splitlines()
    assert left_out == f"note: {tmp_path / 'nine.ply'}: 1 of 9 splats left out, not finite"
    assert foreign.startswith("note: this shape was not trained")
    assert "2 frames of 8 points" in said.out
    again = read_geometry(tmp_path / "00001.ply")
    assert isinstance(again, GaussianSplats)
    assert again.harmonics.shape == (8, 4, 3)


def test_predict_tells_what_is_outside(
    trained: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("predict", trained["nearest"], "--out", tmp_path / "a.npz", "--set", "mass=7") == 0
    said = capsys.readouterr().err.splitlines()
    assert said == ["note: mass = 7 kg is outside the trained range, 0.5 to 1 kg"]


def test_predict_tells_which_times_are_extrapolated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("predict", "kick", "--out", tmp_path / "a.npz", "--times", "0:99:1") == 0
    (note,) = capsys.readouterr().err.splitlines()
    assert note.startswith("note: 97 of 99 frames are outside the trained window, 0 to 1 s")
    assert run("predict", "kick", "--out", tmp_path / "b.npz", "--times", "0:1:0.5") == 0
    assert capsys.readouterr().err == ""


def test_predict_stops_a_motion_that_sinks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Inside the trained box, soft and heavy: three windows on, what continues this model lets it sag too far."""
    setting = ("--set", "mass=1.3", "bending=0.335", "force=39.7", "azimuth=0", "elevation=0.947")
    assert run("predict", "kick/gp", "--out", tmp_path / "a.npz", *setting, "--times", "0:3.6:0.05") == 0
    said = capsys.readouterr()
    assert (stopped := re.search(r"status stopped at t = ([23]\.\d+) s", said.out)) is not None
    assert f"the motion is stopped at t = {stopped[1]} s: it sinks into the floor" in said.err
    with np.load(tmp_path / "a.npz", allow_pickle=False) as arrays:
        assert arrays["vertices"][..., 2].min() > -load("kick/gp").validity.limits.depth
        assert "sinks into the floor" in str(arrays["notes"])


def test_predict_tells_of_a_shape_that_was_not_trained(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shapes = {"box": trimesh.creation.box((1.0, 1.0, 1.0)), "ball": trimesh.creation.icosphere(3)}
    for name, shape in shapes.items():
        shape.export(tmp_path / f"{name}.obj")
        out = tmp_path / f"{name}.npz"
        assert (
            run("predict", "kick", "--geometry", tmp_path / f"{name}.obj", "--out", out, "--times", "0:0.1:0.05") == 0
        )
        said = capsys.readouterr().err
        assert ("note: this shape was not trained: its surface is on average" in said) == (name == "box")
        with np.load(out, allow_pickle=False) as arrays:
            assert ("not trained" in str(arrays["notes"])) == (name == "box")
