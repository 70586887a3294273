"""The page holds what it needs to draw the motions, and says how far these are from the model."""

import base64
import json
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.figure import FigureColumn, Source, Sweep, column_bytes, figure_page, interpolated, truth_error
from odeform.figure.grid import BAND_FRACTION
from odeform.figure.page import MOST_BYTES
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.simulation.recorded import read_truth
from odeform.types import Floats, Mesh, Times


def sweep(predictor: Predictor, name: str, low: float, high: float) -> Sweep:
    return Sweep(next(p for p in predictor.schema.parameters if p.name == name), low, high)


def made(source: Source, times: Times | None = None, bytes_: int = column_bytes(1)) -> FigureColumn:
    return interpolated("model", source, source.predictor.schema.window.times if times is None else times, bytes_)


def embedded(page: bytes) -> tuple[dict[str, Any], list[dict[str, np.ndarray]]]:
    """What the page holds, read as a browser does."""
    found = re.search(r'<script type="application/json" id="figure-data">(.*?)</script>', page.decode(), re.DOTALL)
    assert found
    data = json.loads(found[1])
    arrays = []
    for column in data["columns"]:
        decoded = {}
        for name, array in column["arrays"].items():
            values = np.frombuffer(base64.b64decode(array["data"], validate=True), np.dtype(array["dtype"]))
            decoded[name] = values.reshape(array["shape"])
        arrays.append(decoded)
    return data, arrays


def catmull_rom(values: Floats, place: float) -> Floats:
    """Between values along the first axis, by the matrix of the textbooks."""
    padded = np.concatenate([[2 * values[0] - values[1]], values, [2 * values[-1] - values[-2]]])
    first = min(int(place), len(values) - 2)
    x = place - first
    matrix = 0.5 * np.array([[0, 2, 0, 0], [-1, 0, 1, 0], [2, -5, 4, -1], [-1, 3, -3, 1]])
    return np.tensordot(x ** np.arange(4) @ matrix, padded[first : first + 4], axes=1)


def drawn(data: dict[str, Any], arrays: dict[str, np.ndarray], index: int, places: list[float], time: float) -> Floats:
    """(N, 3) m, as the page draws them."""
    column = data["columns"][index]
    weights = arrays["weights"].astype(float).reshape(*column["counts"], -1)
    for axis, count in zip(column["axes"], column["counts"], strict=True):
        weights = catmull_rom(weights, places[axis] * (count - 1))
    patterns = arrays["patterns"].astype(float)
    y = (arrays["mean"] + np.tensordot(weights.ravel() * arrays["sizes"], patterns, axes=1)) / arrays["scale"]
    y = catmull_rom(y, (time - data["start"]) / data["step"])
    modes = (arrays["basis"] * arrays["steps"][:, None]).reshape(len(arrays["steps"]), -1, 3)
    local = arrays["rest"] + np.tensordot(y[6:], modes, axes=1)
    turn = Rotation.from_euler("z", column["azimuth"])
    return arrays["anchor"] + turn.apply(Rotation.from_rotvec(y[3:6]).apply(local) + y[:3])


@pytest.fixture(scope="module")
def pushed(kick: Predictor) -> FigureColumn:
    sweeps = (sweep(kick, "mass", 0.6, 0.9), sweep(kick, "force", 100.0, 130.0))
    return made(Source(kick, sweeps, {"azimuth": 0.7}), kick.schema.window.times[:40])


def test_what_is_drawn_is_as_far_from_the_model_as_the_page_says(kick: Predictor, pushed: FigureColumn) -> None:
    data, (arrays,) = embedded(figure_page([pushed]))
    rng, errors = np.random.default_rng(7), []
    for place in rng.random((12, 2)):
        mass, force = 0.6 * (0.9 / 0.6) ** place[0], 100.0 + 30.0 * place[1]
        motion = kick.solve(parameters={"mass": mass, "force": force, "azimuth": 0.7})
        times = rng.uniform(0.0, pushed.times[-1], 8)
        apart = [drawn(data, arrays, 0, list(place), t) - motion.vertices(float(t)) for t in times]
        errors.append(1e3 * np.sqrt(np.square(apart).mean()))
    assert np.median(errors) < 1.6 * pushed.error.half
    assert max(errors) < 2.0 * pushed.error.worst
    assert pushed.band_mm is not None
    assert pushed.fine
    assert pushed.error.half <= BAND_FRACTION * pushed.band_mm[0]
    assert pushed.error.most <= BAND_FRACTION * pushed.band_mm[1]


def test_the_page_draws_what_the_column_measures(pushed: FigureColumn) -> None:
    data, (arrays,) = embedded(figure_page([pushed]))
    place, times = np.array([0.37, 0.81]), np.array([0.0031, 0.2])
    for time, points in zip(times, pushed.points(place, times), strict=True):
        np.testing.assert_allclose(drawn(data, arrays, 0, list(place), time), points, atol=2e-6)


def test_the_page_is_one_small_file_and_says_what_it_is(pushed: FigureColumn) -> None:
    page = figure_page([pushed])
    text = page.decode()
    assert len(page) <= MOST_BYTES
    assert text.startswith("<!doctype html>")
    assert not re.search(r"(src|href)=|https?://|@import|import\(", text)
    assert f"{pushed.error.half:.2g} mm of the model" in text
    assert pushed.band_mm is not None
    assert f"half are within {pushed.band_mm[0]:.2g} mm" in text
    assert "azimuth 0.7 rad" in text
    assert "outside of what was trained" not in re.sub(r"<script.*", "", text, flags=re.DOTALL)


def test_little_room_is_kept_to_and_said(kick: Predictor) -> None:
    sweeps = (sweep(kick, "force", 5.0, 160.0),)
    column = made(Source(kick, sweeps, {}), kick.schema.window.times, 1_700_000)
    page = figure_page([column])
    assert len(page) < 1_760_000
    assert ("mm aimed at" in page.decode()) != column.fine
    short = replace(column, tolerance_mm=(1e-3, 2e-3))
    assert not short.fine
    assert "more than the 0.001 and 0.002 mm aimed at" in figure_page([short]).decode()
    assert "* force: partly outside of what was trained." in page.decode()


@pytest.mark.slow
def test_columns_follow_the_sliders_that_they_have(kick: Predictor) -> None:
    times = kick.schema.window.times[:12]
    both = made(Source(kick, (sweep(kick, "mass", 0.6, 0.9), sweep(kick, "force", 100.0, 130.0)), {}), times)
    one = made(Source(kick, (sweep(kick, "force", 100.0, 130.0),), {"mass": 0.7}), times)
    pinned = made(Source(kick, (), {"mass": 0.7, "force": 120.0}), times)
    data, arrays = embedded(figure_page([both, one, pinned]))
    assert [column["axes"] for column in data["columns"]] == [[0, 1], [1], []]
    motion = kick.solve(parameters={"mass": 0.7, "force": 120.0})
    places = [np.log(0.7 / 0.6) / np.log(0.9 / 0.6), 2.0 / 3.0]
    for index, column in enumerate((both, one, pinned)):
        apart = drawn(data, arrays[index], index, places, 0.05) - motion.vertices(0.05)
        assert 1e3 * np.sqrt(np.square(apart).mean()) < 2.0 * column.error.worst + 0.02
    with pytest.raises(InputError, match="expected a model that is not pinned"):
        figure_page([pinned])


@pytest.mark.slow
def test_a_body_that_rests_elsewhere_under_each_mass() -> None:
    predictor = load("contact-force")
    column = made(Source(predictor, (sweep(predictor, "mass", 0.5, 1.2),), {}))
    data, (arrays,) = embedded(figure_page([column]))
    for place in (0.0, 0.4, 1.0):
        motion = predictor.solve(parameters={"mass": 0.5 * (1.2 / 0.5) ** place})
        apart = drawn(data, arrays, 0, [place], 0.1) - motion.vertices(0.1)
        assert 1e3 * np.sqrt(np.square(apart).mean()) < 2.0 * column.error.worst
    assert column.band_mm is None
    assert "The error of the model itself is not known." in figure_page([column]).decode()


def test_a_shape_that_was_not_trained_is_said(kick: Predictor) -> None:
    flat = Mesh(kick.rest.points * np.array([1.0, 1.0, 0.8], dtype=np.float32), kick.rest.faces)
    source = Source(kick, (sweep(kick, "force", 100.0, 130.0),), {}, flat)
    column = made(source, kick.schema.window.times[:12])
    text = figure_page([column]).decode()
    assert "not trained" in text
    assert "The error of the model itself is not known." in text
    motion = kick.solve(flat, {"force": 110.0})
    data, (arrays,) = embedded(figure_page([column]))
    apart = drawn(data, arrays, 0, [1.0 / 3.0], 0.05) - motion.vertices(0.05)
    assert 1e3 * np.sqrt(np.square(apart).mean()) < 2.0 * column.error.worst


def test_what_a_figure_cannot_show(kick: Predictor) -> None:
    sweeps = (sweep(kick, "mass", 0.6, 0.9),)
    with pytest.raises(InputError, match="at least four, evenly spaced, got 3"):
        made(Source(kick, sweeps, {}), np.array([0.0, 0.1, 0.2]))
    with pytest.raises(InputError, match="evenly spaced"):
        made(Source(kick, sweeps, {}), np.array([0.0, 0.1, 0.2, 0.5]))
    with pytest.raises(InputError, match=r"2306 points does not fit into a figure of 0\.1 MB"):
        made(Source(kick, sweeps, {}), bytes_=100_000)
    points = load("mass-elastic/rnn")
    with pytest.raises(InputError, match="a figure needs a pose and a basis"):
        made(Source(points, (sweep(points, "mass", 0.3, 0.5),), {}))


def test_a_truth_is_compared_with_where_the_sliders_have_its_parameters(kick: Predictor) -> None:
    first, other = (read_truth(f"kick/{entry.name}") for entry in open_dataset("kick").select("test")[:2])
    given = {k: v for k, v in kick.schema.known(first.setting).items() if k != "force"}
    column = made(Source(kick, (sweep(kick, "force", 10.0, 160.0),), given), kick.schema.window.times[:8])
    ((compared,),) = ([c["truth"] for c in embedded(figure_page([column], first))[0]["columns"]],)
    assert column.source.sweeps[0].values(np.array(compared["places"])) == pytest.approx(first.setting["force"])
    known = kick.schema.known(first.setting)
    motion = kick.solve(kick.to_body_frame(first.geometry, known), known)
    off = motion.vertices(column.times) - first.vertices(column.times)
    expected = 1e3 * np.sqrt(np.square(off, dtype=float).sum(axis=2).mean(axis=1))
    np.testing.assert_allclose(compared["rms_mm"], expected, atol=1e-3)
    assert truth_error(column, other) is None, "of other parameters than the sliders have"


def test_under_a_load_ranges_are_those_that_were_measured() -> None:
    thrown = load("contact-force").under("throw")
    column = made(Source(thrown, (sweep(thrown, "height", 0.2, 0.6),), {}), thrown.schema.window.times[:8])
    page = figure_page([column]).decode()
    assert "partly outside of what was measured" in page
    assert "of what was trained" not in page


def test_colours_of_a_mesh_are_kept(kick: Predictor) -> None:
    colors = np.random.default_rng(3).integers(0, 256, (len(kick.rest.faces), 1, 3), dtype=np.uint8)
    painted = replace(kick.rest, colors=np.repeat(colors, 3, axis=1))
    column = made(Source(kick, (sweep(kick, "force", 100.0, 130.0),), {}, painted), kick.schema.window.times[:8])
    _, (arrays,) = embedded(figure_page([column]))
    np.testing.assert_array_equal(arrays["corners"][arrays["faces"]], kick.rest.faces)
    np.testing.assert_array_equal(arrays["colors"][arrays["faces"]], painted.colors)
