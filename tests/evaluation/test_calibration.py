"""Bands that are calibrated on whole motions hold for motions that calibrated nothing."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import odeform
from odeform.checkpoint import bundled_checkpoints
from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.evaluation.calibration import attach, whole_motion_scores
from odeform.evaluation.metrics import evaluate
from odeform.models.error_band import SIZES
from odeform.models.registry import load


def test_parts_of_a_data_set_are_disjoint_and_complete() -> None:
    dataset = open_dataset("contact-force")
    parts = [{entry.name for entry in dataset.part(k, 3).select("test")} for k in (1, 2, 3)]
    assert set.union(*parts) == {entry.name for entry in dataset.select("test")}
    assert sum(map(len, parts)) == len(dataset.select("test"))
    for name in dataset.objects:
        each = [len(dataset.part(k, 3).select("test", name)) for k in (1, 2, 3)]
        assert max(each) - min(each) <= 2  # those that failed are counted, too
    with pytest.raises(InputError, match="expected 1 to 3"):
        dataset.part(4, 3)


def test_a_band_holds_for_whole_motions_after_it_was_attached(tmp_path: Path) -> None:
    dataset, out = open_dataset("mass-elastic"), tmp_path / "drop.safetensors"
    predictor = load("mass-elastic/nearest")
    attach(predictor, dataset.part(1, 2), "test", out, "half of them")
    again = load(out)
    assert again.band_motions(again.schema.complete({})) == 50
    assert again.checkpoint.provenance["band"] == "half of them"
    calibrated = evaluate(again, dataset.part(1, 2), "test", window=(0, 151))
    checked = evaluate(again, dataset.part(2, 2), "test", window=(0, 151))
    assert calibrated["motions_covered_90"] >= 0.9
    assert checked["motions_covered_90"] >= 0.72  # three standard deviations of 50 motions by 50 others
    # attached again, from what is attached already, the scores are the same
    attach(again, dataset.part(1, 2), "test", tmp_path / "again.safetensors", "half of them")
    for name, array in load(tmp_path / "again.safetensors").checkpoint.arrays.items():
        np.testing.assert_array_equal(array, again.checkpoint.arrays[name])


def test_each_object_has_a_band_of_its_own(tmp_path: Path) -> None:
    dataset, out = open_dataset("contact-force").of("donut", "chip").part(1, 5), tmp_path / "push.safetensors"
    attach(load("contact-force/nearest"), dataset, "test", out)
    again = load(out)
    for name in ("donut", "chip"):
        assert again.band_motions({"object": name}) == len(dataset.select("test", name))
        sizes = again.checkpoint.arrays[f"{name}/{SIZES}"]
        known = open_dataset("contact-force").of(name)
        for size, entry in zip(sizes[:2], known.select("val"), strict=False):
            moved = known.read(entry)
            own = again.solve(parameters={"object": name, **moved.parameters}).size_mm
            np.testing.assert_allclose(size, own, rtol=1e-3)
    with pytest.raises(InputError, match="at least 9 motions"):
        attach(load("contact-force/nearest"), dataset.part(1, 2), "test", out)


def test_a_model_without_a_band_is_refused() -> None:
    predictor = load("mass-elastic/nearest")
    bare = {name: array for name, array in predictor.checkpoint.arrays.items() if not name.startswith("val.")}
    plain = predictor.of_same_kind(replace(predictor.checkpoint, arrays=bare))
    with pytest.raises(InputError, match="error band"):
        whole_motion_scores(plain, open_dataset("mass-elastic").part(1, 50), "test")


@pytest.mark.parametrize("name", [name for name in bundled_checkpoints() if name.endswith("/odeform")])
def test_bundled_bands_are_of_whole_motions_that_chose_nothing(name: str) -> None:
    predictor = odeform.load(name)
    for body in predictor.schema.objects or ("",):
        named = {"object": body} if body else {}
        assert predictor.band_motions(named) >= 25
    assert "split test, part 1/2" in predictor.checkpoint.provenance["band"]
