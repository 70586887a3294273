import json
import math
from dataclasses import replace

import numpy as np
import pytest

from odeform.errors import InputError
from odeform.schema import Parameter, Schema, Window, soft_clip
from odeform.simulation.scenes.registry import get_scene

SCHEMA = get_scene("kick").schema


def test_survives_json() -> None:
    assert Schema.from_json(json.loads(json.dumps(SCHEMA.to_json()))) == SCHEMA


def test_the_window_of_a_file_is_of_floats() -> None:
    data = json.loads(json.dumps(SCHEMA.to_json()))
    data["window"] |= {"stop": True, "rate": 120}
    window = Schema.from_json(data).window
    assert window.soft_clamped(np.array(window.stop)) == 1.0
    assert type(window.stop) is type(window.rate) is float


@pytest.mark.parametrize("stop", [None, "soon", [], float("nan")])
def test_a_window_without_numbers_is_refused(stop: object) -> None:
    data = SCHEMA.to_json()
    data["window"]["stop"] = stop
    with pytest.raises(InputError):
        Schema.from_json(data)


@pytest.mark.parametrize("wrong", [{"objects": [["cat"]]}, {"objects": "cat"}, {"parameters": [{"name": ["mass"]}]}])
def test_names_are_texts(wrong: dict[str, object]) -> None:
    with pytest.raises(InputError, match="expected names"):
        Schema.from_json({**SCHEMA.to_json(), **wrong})


def test_ranges_map_to_the_unit_cube() -> None:
    for parameter in SCHEMA.parameters:
        assert parameter.normalise(parameter.low) == pytest.approx(-1.0)
        assert parameter.normalise(parameter.high) == pytest.approx(1.0)
        middle = math.sqrt if parameter.scale == "log" else lambda x: x / 2.0
        between = parameter.low * parameter.high if parameter.scale == "log" else parameter.low + parameter.high
        assert parameter.normalise(middle(between)) == pytest.approx(0.0, abs=1e-12)
        for unit in (-1.4, -0.3, 0.9, 1.7):
            assert parameter.normalise(parameter.denormalise(unit)) == pytest.approx(unit)


def test_ends_of_the_window_are_frames() -> None:
    assert np.allclose(Window(0.25, 1.0, 20.0).times, 0.25 + 0.05 * np.arange(16))


def test_completes_with_defaults_in_order() -> None:
    complete = SCHEMA.complete({"force": "100", "mass": 0.4})
    assert list(complete) == [p.name for p in SCHEMA.parameters]
    assert complete["force"] == 100.0
    assert complete["bending"] == next(p.default for p in SCHEMA.parameters if p.name == "bending")


def test_the_heading_is_not_learned() -> None:
    one, two = (SCHEMA.complete({"azimuth": angle}) for angle in (0.0, 2.0))
    assert np.array_equal(SCHEMA.vector(one), SCHEMA.vector(two))
    assert SCHEMA.vector(one).shape == (4,)
    assert SCHEMA.azimuth(two) == 2.0


def test_outside_is_told_and_the_edge_is_inside() -> None:
    edge = {p.name: p.high for p in SCHEMA.parameters}
    assert SCHEMA.outside(SCHEMA.complete(edge)) == ()
    assert SCHEMA.outside(SCHEMA.complete({**edge, "force": 161.0, "azimuth": 99.0})) == ("force",)


def test_a_property_of_the_body_is_inside_to_the_three_digits_that_are_shown() -> None:
    mass = Parameter("mass", "kg", 0.37265, 1.4906, 0.7453, "log", "body")
    assert [mass.inside(value) for value in (0.3725, 0.37, 1.491, 1.5)] == [True, False, True, False]
    other = replace(mass, role="physical")
    assert not other.inside(1.491)


def test_what_is_beyond_fades() -> None:
    inside, beyond = np.linspace(-1.0, 1.0, 41), np.array([1.0, 1.01, 1.1, 2.0, 10.0, np.inf])
    assert np.array_equal(soft_clip(inside, 1.0, 0.25), inside)
    seen = soft_clip(beyond, 1.0, 0.25)
    assert (np.diff(seen[:4]) > 0.0).all()
    assert np.allclose(seen[:3], beyond[:3], atol=6e-3), "it begins smoothly"
    assert seen[-1] == 1.25
    assert np.array_equal(soft_clip(-beyond, 1.0, 0.25), -seen)


def test_models_see_little_beyond_the_trained_box() -> None:
    inside = {p.name: p.denormalise(0.7) for p in SCHEMA.parameters}
    exact = [p.normalise(inside[p.name]) for p in SCHEMA.learned]
    assert np.array_equal(SCHEMA.inputs(SCHEMA.complete(inside)), exact)
    enormous = SCHEMA.inputs(SCHEMA.complete({**inside, "force": -1e308, "mass": 1e308}))
    assert enormous.tolist() == [1.15, exact[1], -1.15, exact[3]]


def test_clocks_stop_after_the_trained_window() -> None:
    window = Window(0.0, 2.0, 20.0)
    assert np.array_equal(window.soft_clamped(window.times), window.times)
    assert 2.04 < window.soft_clamped(np.array([2.05]))[0] < 2.05
    assert np.array_equal(window.soft_clamped(np.array([40.0, 1e300])), [2.1, 2.1])
    continued = replace(window, reach=0.5)
    assert np.array_equal(continued.soft_clamped(np.array([2.5, 3.0, 1e300])), [2.5, 3.0, 3.1])


@pytest.mark.parametrize(
    "given",
    [{"Mass": 0.5}, {"mass": "x"}, {"mass": None}, {"mass": math.nan}, {"mass": 0.0}, {"force": -math.inf}],
    ids=str,
)
def test_impossible_parameters(given: dict) -> None:
    with pytest.raises(InputError, match=next(iter(given))):
        SCHEMA.complete(given)


@pytest.mark.parametrize(
    ("low", "high", "default", "scale", "reason"),
    [
        (1.0, 0.5, 0.7, "linear", "low < high"),
        (1.0, 1.0, 1.0, "linear", "low < high"),
        (math.nan, 1.0, 0.5, "linear", "low < high"),
        (0.5, 1.0, 2.0, "linear", "default from 0.5 to 1, got 2"),
        (0.0, 1.0, 0.5, "log", "positive low"),
    ],
)
def test_impossible_ranges(low: float, high: float, default: float, scale: str, reason: str) -> None:
    with pytest.raises(InputError, match=f"parameter mass: .*{reason}"):
        Parameter("mass", "kg", low, high, default, scale)


@pytest.mark.parametrize("reach", [1.0, 3.0])
def test_corners_are_those_of_the_trained_box(reach: float) -> None:
    schema = get_scene("kick").schema
    corners = schema.corners(reach)
    vectors = np.stack([schema.vector(parameters) for parameters in corners])
    assert np.allclose(np.abs(vectors), reach)
    assert len(np.unique(np.round(vectors), axis=0)) == len(corners) == 2 ** len(schema.learned)
    assert {parameters["azimuth"] for parameters in corners} == {0.0}


def test_three_components_are_one_vector() -> None:
    push = [replace(SCHEMA.parameters[0], name=f"push_{axis}") for axis in "xyz"]
    schema = replace(SCHEMA, parameters=(*SCHEMA.parameters, *push))
    for given in ("1,2,3", [1.0, "2", 3], np.array([1.0, 2.0, 3.0])):
        complete = schema.complete({"push": given})
        assert [complete[f"push_{axis}"] for axis in "xyz"] == [1.0, 2.0, 3.0]
    with pytest.raises(InputError, match="push: expected three numbers"):
        schema.complete({"push": "1,2"})
    with pytest.raises(InputError, match="unknown parameter 'pull'"):
        schema.complete({"pull": "1,2,3"})
    assert SCHEMA.known({"mass": 0.6, "radius_m": 0.1}) == {"mass": 0.6}


def test_an_object_is_chosen_by_name() -> None:
    schema = replace(SCHEMA, objects=("cat", "dog"))
    assert Schema.from_json(json.loads(json.dumps(schema.to_json()))) == schema
    assert schema.complete({})["object"] == "cat"
    complete = schema.complete({"mass": "0.6", "object": "dog"})
    assert tuple(complete) == schema.names == ("object", *SCHEMA.names)
    assert complete["object"] == "dog"
    assert np.array_equal(schema.vector(complete), SCHEMA.vector(SCHEMA.complete({"mass": 0.6})))
    assert schema.outside(complete) == ()
    assert schema.known({"object": "dog", "radius_m": 0.1}) == {"object": "dog"}
    for name in ("cow", None, 3.0):
        with pytest.raises(InputError, match=r"unknown object .*: scene kick has cat, dog"):
            schema.complete({"object": name})
    with pytest.raises(InputError, match="unknown parameter 'object'"):
        SCHEMA.complete({"object": "cat"})
    with pytest.raises(InputError, match="no corners"):
        schema.corners()
