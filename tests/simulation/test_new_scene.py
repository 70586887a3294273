"""A scene of one's own, registered by one line: simulated, studied and shown. Nothing here needs MuJoCo."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.geometry.primitives import octasphere
from odeform.loads.arrow import Arrow
from odeform.schema import Parameter, Parameters, Schema, Window
from odeform.simulation.runner import simulate
from odeform.simulation.scene import Scene
from odeform.simulation.scenes.registry import SCENES, find_scene, get_scene
from odeform.types import Mesh, MotionSequence, Points
from odeform_figures.studies.measurements import SCENES as MEASURED
from odeform_figures.studies.measurements import Figures, Measurements
from odeform_figures.studies.study import study

BODY = octasphere(0.1, 2)


def slide(parameters: Parameters, rate: float | None = None, step: float = 0.01) -> MotionSequence:
    """A rigid body slides along x and slows down. Its speed is integrated in explicit Euler steps."""
    times = np.arange(round(0.5 * (rate or 20.0)) + 1) / (rate or 20.0)
    fine = np.arange(round(0.5 / step) + 1) * step
    speed = parameters["speed"] * (1.0 - parameters["drag"] * step) ** np.arange(len(fine))
    along = np.interp(times, fine, np.concatenate([[0.0], np.cumsum(speed[:-1]) * step]))
    vertices = BODY.points + along[:, None, None] * [1.0, 0.0, 0.0]
    count = len(BODY.points)
    weights = np.full(count, 1.0 / count)
    return MotionSequence(times, vertices.astype(np.float32), BODY.faces, weights, dict(parameters))


def distance(coarse: MotionSequence, fine: MotionSequence) -> Figures:
    return {"distance_m": float(np.ptp(fine.vertices[:, 0, 0]))}


def velocity(parameters: Parameters, rest_points: Points) -> tuple[Arrow, ...]:
    start = rest_points.mean(axis=0)
    return (Arrow(start, np.array([parameters["speed"], 0.0, 0.0]), "speed", 0.0, 0.5),)


def rest_mesh() -> Mesh:
    return octasphere(0.1, 4)


SCHEMA = Schema(
    "slide",
    (Parameter("speed", "m/s", 0.5, 2.0, 1.0), Parameter("drag", "1/s", 0.1, 1.0, 0.5)),
    Window(0.0, 0.5, 20.0),
)
SCENE = Scene(SCHEMA, slide, rest_mesh, step=0.01, count=8, glyphs=velocity)


@pytest.fixture
def toy(monkeypatch: pytest.MonkeyPatch) -> Scene:
    monkeypatch.setitem(SCENES, "slide", f"{__name__}:SCENE")
    return SCENE


def test_the_registry_knows_every_scene_by_its_own_name(toy: Scene) -> None:
    assert [get_scene(name).schema.scene for name in SCENES] == ["mass-elastic", "kick", "contact-force", "slide"]
    assert get_scene("slide") is toy


def test_an_unknown_scene_is_an_error_that_names_the_known_ones() -> None:
    assert find_scene("throw") is None
    with pytest.raises(InputError, match="'throw': expected one of mass-elastic, kick"):
        get_scene("throw")


def test_a_scene_of_another_name_than_its_own_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(SCENES, "glide", f"{__name__}:SCENE")
    with pytest.raises(InputError, match="scene 'glide': expected the same name in its schema, got 'slide'"):
        find_scene("glide")


@pytest.mark.usefixtures("toy")
def test_a_new_scene_makes_a_data_set(tmp_path: Path) -> None:
    made = simulate("slide", tmp_path, count=8, seed=1)
    assert [entry.status for entry in made.entries] == ["ok"] * 8
    assert open_dataset(tmp_path).schema == replace(SCHEMA, surroundings=SCENE.surroundings)
    test = next(made.sequences("test"))
    assert np.array_equal(test.vertices, slide(test.parameters, rate=80.0).vertices)


@pytest.mark.usefixtures("toy")
def test_a_new_scene_is_studied_by_its_own_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(MEASURED, "slide", lambda: Measurements(figures=distance))
    found = study("slide", count=3, seed=0, workers=1)
    assert [row["parameters"] for row in found["sequences"]] == SCENE.sample(3, 0)
    assert found["largest_distance_m"] == max(row["distance_m"] for row in found["sequences"])
    assert 0.0 < found["halving_rmse_mm"] < 10.0
    # a faster and a more slowed motion differ, but not by much within half a second
    assert 1.0 < found["largest_condition"] < 1e3
    assert "rebound_mm" not in found["sequences"][0]


def test_extremes_are_studied_before_samples(toy: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    extreme = {"speed": 2.0, "drag": 1.0}
    hard = Measurements((extreme,), ("speed",), lambda _: slice(0, 2))
    monkeypatch.setitem(MEASURED, "slide", lambda: hard)
    found = study("slide", count=2, seed=0, workers=1)
    assert [row["parameters"] for row in found["sequences"]] == [extreme, *toy.sample(1, 0)]
    # one parameter cannot be mistaken for another
    assert found["largest_condition"] == pytest.approx(1.0)


def test_a_new_scene_brings_its_arrows(toy: Scene) -> None:
    (arrow,) = toy.glyphs({"speed": 1.5, "drag": 0.1}, BODY.points)
    assert arrow.vector.tolist() == [1.5, 0.0, 0.0]
    assert np.allclose(arrow.start, 0.0, atol=1e-12)
    assert get_scene("mass-elastic").glyphs({"mass": 1.0, "bending": 1.0}, BODY.points) == ()


@pytest.mark.slow
def test_scenes_need_no_simulator_to_be_looked_at() -> None:
    code = (
        "import sys; from odeform.simulation.scenes.registry import SCENES, get_scene;"
        "[get_scene(n).rest_mesh() for n in SCENES]; sys.exit('mujoco' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0
