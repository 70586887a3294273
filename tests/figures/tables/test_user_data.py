"""The study of small data sets: trained once, compared with the best rival."""

from dataclasses import replace
from pathlib import Path

import pytest

from odeform_figures.motions.registry import KINDS
from odeform_figures.tables import user_data
from odeform_figures.tables.user_data import MODELS, main, summary


def scores(*errors: float) -> user_data.Scores:
    return {model: {"rmse_pooled_mm": error} for model, error in zip(MODELS, errors, strict=True)}


def test_ratios_are_to_the_best_rival() -> None:
    lines = summary({"walk": [scores(1.0, 4.0, 2.0, 9.0)], "throw": [scores(4.0, 2.0, 3.0, 9.0)]})
    assert lines[2] == "| walk | 1 | 4 | 2 | 9 | 0.50 |"
    assert lines[3].endswith("| 2.00 |")
    assert lines[4] == "| geometric mean | | | | | 1.00 |"


def test_data_sets_of_a_kind_are_averaged() -> None:
    lines = summary({"walk": [scores(1.0, 4.0, 3.0, 9.0), scores(3.0, 2.0, 9.0, 9.0)]})
    assert lines[2] == "| walk | 2 ± 1.4 | 3 ± 1.4 | 6 ± 4.2 | 9 ± 0 | 0.67 |"


@pytest.mark.slow
def test_a_kind_is_made_trained_and_not_trained_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(KINDS, "throw", replace(KINDS["throw"], sequences=16, frames=10))
    arguments = ["--keep", str(tmp_path), "--kinds", "throw", "--minutes", "0.05"]
    main(arguments)
    first = capsys.readouterr().out
    assert "| throw |" in first
    kept = {file: file.stat().st_mtime_ns for file in tmp_path.glob("*.safetensors")}
    assert len(kept) == len(MODELS)
    main(arguments)
    assert capsys.readouterr().out == first
    main([*arguments, "--seeds", "2"])
    assert "±" in capsys.readouterr().out
    assert (tmp_path / "throw-1" / "dataset.json").exists()
    assert {file: file.stat().st_mtime_ns for file in kept} == kept
