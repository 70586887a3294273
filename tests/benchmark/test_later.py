"""Motions over several windows are compared with what the simulator says."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from odeform.benchmark.later import SPANS, compare_later, main, simulate_later
from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.models.registry import load
from odeform.simulation.scenes.kick import SCHEMA, simulate


def test_a_ball_at_rest_stays_so_for_as_long_as_is_asked() -> None:
    dataset = open_dataset("mass-elastic")
    later = simulate_later(dataset, 2)
    window = dataset.schema.window
    assert later.times[-1] == pytest.approx(window.start + SPANS[-1][1] * (window.stop - window.start))
    assert all(len(vertices) == len(later.times) for vertices in later.vertices)
    found = compare_later(load("mass-elastic"), later)
    assert found["motions"] == 2
    spans = found["windows"]
    assert all(0.0 < spans[f"{a:g}:{b:g}"]["median_mm"] < 1.0 for a, b in SPANS)
    # a model that is somewhere else is as wrong as that
    jump = np.where(later.times > 0.0, 0.01, 0.0).astype(np.float32)[:, None, None]
    moved = replace(later, vertices=[vertices + jump for vertices in later.vertices])
    off = compare_later(load("mass-elastic"), moved)["windows"]["1:2"]
    assert off["pooled_mm"] > 8.0
    assert off["coverage_90"] < 0.5 < spans["1:2"]["coverage_90"]


def test_the_command_writes_the_comparison(tmp_path: Path) -> None:
    out = tmp_path / "later.json"
    main(["mass-elastic/nearest", "--count", "1", "--json", str(out)])
    found = json.loads(out.read_text())
    assert found["command"] == "python -m odeform.benchmark.later mass-elastic/nearest --count 1"
    assert set(found["models"]) == {"mass-elastic/nearest"}


def test_checkpoints_are_of_one_scene() -> None:
    with pytest.raises(InputError, match="kick, mass-elastic"):
        main(["kick", "mass-elastic"])


@pytest.mark.slow
def test_a_longer_simulation_begins_as_the_shorter_one() -> None:
    parameters = SCHEMA.complete({"azimuth": 0.3})
    short, long = (simulate(parameters, step=2e-3, resolution=5, until=until) for until in (0.1, 0.3))
    assert long.times[-1] == pytest.approx(0.3)
    assert np.array_equal(long.vertices[: len(short.times)], short.vertices)
