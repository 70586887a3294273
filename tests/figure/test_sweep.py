"""The parameters of a figure."""

import numpy as np
import pytest

from odeform.errors import InputError
from odeform.figure import parse_sweeps
from odeform.models.base import Predictor


def test_values_are_spaced_as_the_parameter_asks(kick: Predictor) -> None:
    mass, force = parse_sweeps(kick.schema, {"mass": "0.4:1.6", "force": "20:40"})
    np.testing.assert_allclose(mass.values(np.array([0.0, 0.5, 1.0])), [0.4, 0.8, 1.6])
    np.testing.assert_allclose(force.values(np.array([0.0, 0.5, 1.0])), [20.0, 30.0, 40.0])
    assert mass.place(0.8) == pytest.approx(0.5)
    assert force.place(35.0) == pytest.approx(0.75)


@pytest.mark.parametrize(
    ("ranges", "said"),
    [
        ({}, "expected one to 3 parameters, got 0"),
        ({name: "0.5:1" for name in ("mass", "bending", "force", "elevation")}, "got 4"),
        ({"speed": "0:1"}, "expected a parameter out of mass, bending, force, elevation, got 'speed'"),
        ({"azimuth": "0:1"}, "'azimuth', which only turns the scene"),
        ({"mass": "1:0.5"}, "mass: expected LOW below HIGH, got 1:0.5"),
        ({"mass": "1:1"}, "expected LOW below HIGH"),
        ({"mass": "1"}, "mass: expected LOW:HIGH, got '1'"),
        ({"mass": "1:2:3"}, "expected LOW:HIGH"),
        ({"mass": "light:heavy"}, "mass: expected a number in kg, got 'light'"),
        ({"mass": "0:1"}, "mass: expected a positive number"),
        ({"force": "10:inf"}, "force: expected a finite number"),
        ({"elevation": "0:1"}, "elevation: is given by --set as well"),
    ],
)
def test_bad_ranges(kick: Predictor, ranges: dict[str, str], said: str) -> None:
    with pytest.raises(InputError, match="--sweep") as error:
        parse_sweeps(kick.schema, ranges, ("elevation",) if "elevation" in ranges and len(ranges) == 1 else ())
    assert said in str(error.value)
    assert "\n" not in str(error.value)
