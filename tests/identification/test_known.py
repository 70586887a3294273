"""The default model error of `identify`: that of the checkpoint, else calibrated on the bundled data set."""

from dataclasses import replace

import numpy as np
import pytest

from odeform.dataset.index import Dataset
from odeform.dataset.store import bundled_datasets
from odeform.errors import InputError
from odeform.identification import known
from odeform.identification.discrepancy import PREFIX, Discrepancy
from odeform.identification.identify import identify
from odeform.identification.known import known_discrepancy, why_not_identifiable
from odeform.identification.observation import Observation
from odeform.models.base import Predictor
from odeform.models.registry import load

SCENE, WITHOUT = "mass-elastic", "mass-elastic/pod-rbf"  # a model without a calibration in its checkpoint
Calls = list[tuple[Predictor, Dataset]]


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> Calls:
    """The calls of `calibrate`, which here returns a nominal error without measuring it."""
    made: Calls = []

    def calibrate(predictor: Predictor, dataset: Dataset, progress: object) -> Discrepancy:
        made.append((predictor, dataset))
        times = predictor.schema.window.times[1:]
        shape = (len(times), 6 + predictor.solve().space.basis.modes)
        return Discrepancy(times, np.full(shape, 1e-6), np.zeros((*shape, 1 + len(predictor.schema.learned))))

    monkeypatch.setattr(known, "calibrate", calibrate)
    return made


def test_calibrates_once_for_each_predictor_on_the_data_set_of_its_scene(calls: Calls) -> None:
    one, other = load(WITHOUT), load(WITHOUT)
    first, again, second = (known_discrepancy(predictor) for predictor in (one, one, other))
    assert again is first
    assert second is not first
    assert [predictor for predictor, _ in calls] == [one, other]
    assert [dataset.root for _, dataset in calls] == [bundled_datasets()[SCENE]] * 2


def test_is_the_default_of_identify(calls: Calls) -> None:
    predictor = load(WITHOUT)
    times, rest = predictor.schema.window.times[2:60:6], predictor.rest.points[::100]
    positions = predictor.solve().vertices(times)[:, ::100].astype(float)
    observation = Observation(rest, times, positions)
    default = identify(predictor, observation)
    assert [calibrated for calibrated, _ in calls] == [predictor]
    given = identify(predictor, observation, known_discrepancy(predictor))
    assert default.parameters == given.parameters


def test_other_physics_than_in_training_are_refused(calls: Calls) -> None:
    predictor = load(WITHOUT)
    provenance = {**predictor.checkpoint.provenance, "fixed": {"mass": -1.0}}
    predictor.checkpoint = replace(predictor.checkpoint, provenance=provenance)
    with pytest.raises(InputError, match=r"the model was trained with \{'mass': -1.0\}"):
        known_discrepancy(predictor)
    assert not calls


def test_a_scene_without_a_bundled_data_set_is_refused(calls: Calls, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(known, "bundled_datasets", dict)
    with pytest.raises(InputError, match=f"no bundled data set of scene {SCENE}"):
        known_discrepancy(load(WITHOUT))
    assert not calls


def test_a_checkpoint_brings_its_own(calls: Calls) -> None:
    predictor = load(SCENE)
    kept = known_discrepancy(predictor)
    assert not calls
    assert np.array_equal(kept.times, predictor.schema.window.times[1:].astype(np.float32))
    arrays = predictor.checkpoint.arrays
    assert {name: array for name, array in arrays.items() if name.startswith(PREFIX)}.keys() == kept.arrays().keys()


def test_a_damaged_calibration_is_refused() -> None:
    predictor = load(SCENE)
    arrays = predictor.checkpoint.arrays
    for name, damaged in {"means": np.zeros((3, 2)), "variances": np.zeros_like(arrays[f"{PREFIX}variances"])}.items():
        predictor.checkpoint = replace(predictor.checkpoint, arrays={**arrays, PREFIX + name: damaged})
        with pytest.raises(InputError, match="damaged"):
            known_discrepancy(predictor)


def test_models_of_several_objects_are_refused() -> None:
    assert "single body" in why_not_identifiable(load("contact-force"))
