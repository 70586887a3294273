import json
from pathlib import Path

import numpy as np
import pytest

from odeform.errors import InputError
from odeform.geometry.region import Box, Region, Sphere, read_region, region_to_json
from odeform.geometry.rigid import rotation_z
from odeform.geometry.similarity import UPRIGHT, Similarity

POINTS = np.random.default_rng(0).uniform(-1.0, 1.0, size=(2000, 3))
SPHERE = Sphere(np.array([0.2, 0.0, -0.1]), 0.5)
BOX = Box(np.array([0.1, 0.2, 0.0]), np.array([1.0, 0.4, 0.6]), rotation_z(0.5))


def test_inside() -> None:
    at = np.array([[0.2, 0.0, 0.4], [0.2, 0.0, 0.41], [0.2, 0.0, -0.1]])
    assert SPHERE.contains(at).tolist() == [True, False, True]
    along = np.array([np.cos(0.5), np.sin(0.5), 0.0])
    assert BOX.contains(BOX.centre + np.outer([0.49, 0.51], along)).tolist() == [True, False]
    assert not BOX.contains(BOX.centre + np.array([[0.49, 0.0, 0.0]])).any()  # an unturned box would hold it


@pytest.mark.parametrize("region", [SPHERE, BOX], ids=["sphere", "box"])
def test_a_moved_region_holds_what_it_held(region: Region) -> None:
    move = Similarity(0.067, UPRIGHT["-y"], np.array([1.0, 2.0, 3.0]))
    inside = region.contains(POINTS)
    assert 50 < inside.sum() < 1000
    assert np.array_equal(region.transformed(move).contains(move.points(POINTS)), inside)
    assert np.array_equal(region.transformed(move).transformed(move.inverse).contains(POINTS), inside)


@pytest.mark.parametrize("region", [SPHERE, BOX], ids=["sphere", "box"])
def test_files(tmp_path: Path, region: Region) -> None:
    path = tmp_path / "a.region.json"
    path.write_text(json.dumps(region_to_json(region)))
    again = read_region(path)
    assert type(again) is type(region)
    assert np.array_equal(again.contains(POINTS), region.contains(POINTS))


DAMAGED = (
    "",
    "[]",
    "{}",
    '{"cone": {}}',
    '{"sphere": {"centre": [0, 0, 0]}}',
    '{"sphere": {"centre": [0, 0], "radius": 1}}',
    '{"sphere": {"centre": [0, NaN, 0], "radius": 1}}',
    '{"box": {"centre": [0, 0, 0], "size": "large"}}',
)


@pytest.mark.parametrize("text", DAMAGED)
def test_refuses(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.region.json"
    path.write_text(text)
    with pytest.raises(InputError, match=r"a\.region\.json"):
        read_region(path)
