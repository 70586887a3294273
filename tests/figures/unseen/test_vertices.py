"""Vertices that are held out of training."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from odeform.dataset.index import Dataset, Entry
from odeform.models.base import Predictor
from odeform.simulation.objects.catalog import get_object
from odeform.simulation.scenes.contact_force import SCENE
from odeform.types import MotionSequence
from odeform_figures.unseen.vertices import errors_at, held_out, without_vertices


def still(entry: Entry) -> MotionSequence:
    rest, count = get_object("donut").rest_mesh(), 20
    vertices = np.repeat(rest.points[None], count, axis=0)
    weights = np.full(len(rest.points), 1.0 / len(rest.points))
    return MotionSequence(np.arange(count) / 100.0, vertices, rest.faces, weights, {"object": "donut"}, entry.name)


SCHEMA = replace(SCENE.schema, objects=("donut",))
DATA = Dataset(Path("none"), SCHEMA, (Entry("one", "test", {"object": "donut"}),), still, {})


def test_a_tenth_of_the_vertices_has_no_weight() -> None:
    (sequence,) = without_vertices(DATA, 0.1, 0).sequences("test")
    hidden = held_out(len(sequence.weights), 0.1, 0)
    assert hidden.sum() == round(0.1 * len(hidden))
    assert not sequence.weights[hidden].any()
    assert (sequence.weights[~hidden] > 0.0).all()
    assert np.isclose(sequence.weights.sum(), 1.0)
    assert (held_out(len(hidden), 0.1, 1) != hidden).any()


class Shifted(Predictor):
    """Is wrong by 2 mm at vertices that are held out, and by 1 mm at the others."""

    def __init__(self) -> None:
        pass

    def solve(self, geometry: None, parameters: dict[str, Any]) -> SimpleNamespace:  # pyright: ignore
        truth = still(DATA.entries[0])
        hidden = held_out(len(truth.weights), 0.1, 0)
        moved = truth.vertices + np.where(hidden, 0.002, 0.001)[:, None] * (truth.times > 0.0)[:, None, None]
        return SimpleNamespace(vertices=lambda times: moved.astype(np.float32))

    def _read(self, checkpoint: Any) -> None:
        raise NotImplementedError

    def _solve(self, *given: Any) -> Any:
        raise NotImplementedError


def test_errors_are_those_of_each_group() -> None:
    found = errors_at(Shifted(), DATA, 0.1, 0)["donut"]
    assert np.isclose(found["held_out_mm"], 2.0, rtol=1e-4)
    assert np.isclose(found["others_mm"], 1.0, rtol=1e-4)
    assert np.isclose(found["ratio"], 2.0, rtol=1e-4)
