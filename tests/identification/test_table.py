import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from odeform.cli import main
from odeform.dataset import store
from odeform.dataset.index import Dataset
from odeform.errors import InputError
from odeform.identification.discrepancy import calibrate
from odeform.identification.table import identify_split
from odeform.models.registry import load


@pytest.fixture(scope="module")
def few() -> Dataset:
    """Eight sequences to calibrate on and two to score."""
    whole = store.open_dataset("mass-elastic")
    return replace(whole, entries=(*whole.select("val")[:8], *whole.select("test")[:2]))


@pytest.mark.slow
def test_correlated_errors_carry_less_information(few: Dataset) -> None:
    predictor = load("mass-elastic")
    shares: list[float] = []
    discrepancy = calibrate(predictor, few, progress=shares.append)
    assert shares == pytest.approx(np.arange(1, 9) / 8)
    assert np.isfinite(discrepancy.variances).all()
    # never below the rounding error; constant after the last frame
    assert discrepancy.variances.min() >= 0.99 * 2e-3**2
    assert np.array_equal(discrepancy.at(np.array([9.0]))[0], discrepancy.at(discrepancy.times[-1:])[0])
    # the fall is predicted better than the motion after the landings
    assert np.median(discrepancy.at(np.array([0.2]))) < np.median(discrepancy.at(np.array([1.0])))


@pytest.mark.slow
def test_the_command(
    few: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.setattr(store, "open_dataset", lambda _: few)
    out = tmp_path / "found.json"
    assert main(["identify", "mass-elastic", "--data", "few", "--json", str(out)]) == 0
    result = json.loads(out.read_text())
    assert result["sequences"] == len(result["rows"]) == 2
    assert set(result["parameters"]) == {"mass", "bending"}
    for scores in result["parameters"].values():
        assert {"mae", "unit", "mae_normalised", "coverage_90", "identifiable"} <= set(scores)
        assert scores["mae_normalised"] < 0.05
        assert scores["identifiable"] == 1.0
    table = capsys.readouterr().out
    assert "bending" in table
    assert "2 sequences of test" in table


def test_too_few_sequences_to_calibrate_on_are_rejected(few: Dataset) -> None:
    with pytest.raises(InputError, match="at least 8"):
        identify_split(load("mass-elastic/pod-rbf"), replace(few, entries=few.entries[5:]))


def test_an_empty_split_is_rejected(few: Dataset) -> None:
    with pytest.raises(InputError, match="train"):
        identify_split(load("mass-elastic"), few, "train")


def test_a_data_set_of_another_scene_is_rejected(few: Dataset) -> None:
    with pytest.raises(InputError, match="kick"):
        identify_split(load("kick"), few)


def test_a_limit_of_zero_is_rejected(capsys: pytest.CaptureFixture) -> None:
    assert main(["identify", "mass-elastic", "--data", "mass-elastic", "--limit", "0"]) == 2
    assert "--limit" in capsys.readouterr().err
