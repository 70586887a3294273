"""Runs are trained once and kept; the page shows every model and leaves missing entries empty."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from odeform.checkpoint import read_checkpoint, write_checkpoint
from odeform.dataset.index import Dataset
from odeform.evaluation.metrics import evaluate
from odeform.models.registry import load
from odeform.simulation.objects.catalog import OBJECTS
from odeform_figures.tables.cells import _led
from odeform_figures.tables.page import page
from odeform_figures.tables.plan import AHEAD, FINAL, FORCE, FRAMES, IMPACT, INTERVALS, UNTIL, plan
from odeform_figures.tables.runs import ALONE, KEPT, Result, Run, complete_runs


@pytest.fixture(scope="module")
def run(dataset: Dataset) -> Run:
    return Run("nearest", str(dataset.root), ((0, 121), (60, 70)))


@pytest.fixture(scope="module")
def folder(run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("runs")
    complete_runs([run, replace(run, every=4, stagger=True)], out, jobs=2)
    return out


def test_scores_are_those_of_the_checkpoint(run: Run, folder: Path, dataset: Dataset) -> None:
    result = complete_runs([run], folder, 1)[run]
    model = load(folder / f"{run.name}.safetensors")
    assert result["sha256"] == model.checkpoint.sha256
    again = evaluate(model, dataset, "test", (60, 70))
    # single-precision products of other sizes round differently
    assert result["scores"]["60:70"] == pytest.approx({name: again[name] for name in KEPT}, rel=1e-5)
    assert "odeform train" in result["command"]


def test_a_finished_run_is_not_repeated(run: Run, folder: Path) -> None:
    def written() -> dict[str, int]:
        return {file.name: file.stat().st_mtime_ns for file in folder.glob("*.safetensors")}

    before = written()
    complete_runs([run], folder, 1)
    assert written() == before
    assert len(before) == 2


def test_scores_are_enough_without_the_checkpoint(run: Run, folder: Path) -> None:
    file = folder / f"{run.name}.safetensors"
    whole = file.read_bytes()
    file.unlink()
    found = complete_runs([run], folder, 1, kept_only=True)[run]
    assert found["scores"].keys() == {"0:121", "60:70"}
    assert not file.exists()
    # other windows need the checkpoint
    assert complete_runs([replace(run, scored=((0, 60),))], folder, 1, kept_only=True) == {}
    file.write_bytes(whole)


def test_an_interrupted_run_is_trained_again(run: Run, folder: Path) -> None:
    file = folder / f"{run.name}.safetensors"
    whole = read_checkpoint(file)
    write_checkpoint(file, replace(whole, scores={}))
    file.with_suffix(".json").unlink()
    assert complete_runs([run], folder, 1, kept_only=True) == {}
    complete_runs([run], folder, 1)
    assert read_checkpoint(file).scores == whole.scores


def test_sparse_frames_score_worse(run: Run, folder: Path) -> None:
    sparse = replace(run, every=4, stagger=True)
    found = complete_runs([run, sparse], folder, 1, kept_only=True)
    one, other = (found[c]["scores"]["0:121"]["deformation_relative"] for c in (run, sparse))
    assert other > one


def test_the_page_shows_every_model_and_leaves_missing_entries_empty() -> None:
    def result(run: Run) -> Result:
        scores = {f"{a}:{b}": dict.fromkeys(KEPT, 1.0 + run.seed) for a, b in run.scored}
        if run.scene == FORCE:
            objects = {name: dict.fromkeys(KEPT, 0.25 + index) for index, name in enumerate(OBJECTS)}
            scores = {span: {**values, "objects": objects} for span, values in scores.items()}
        elif run.until and run.model in ("odeform", "gp"):
            scores |= {f"{span}{ALONE}": dict.fromkeys(KEPT, 30.0) for span in scores}
        return {"command": run.name, "sha256": "", "parameters": 7, "seconds": 1.0, "scores": scores}

    some = dict.fromkeys(KEPT, 0.5)
    spans = [*FRAMES.items(), ("mass-elastic", IMPACT), (FORCE, FINAL)]
    simple = [f"{name} {u}:{u + AHEAD}" for name in ("continued", "hold-last", "ballistic") for u in UNTIL]
    simple += [f"spline {k}{way}" for k in INTERVALS for way in ("", " staggered")]
    runs = {table: {one: result(one) for one in of if one.scene != "kick"} for table, of in plan().items()}
    one = {"mae_normalised": 0.01, "coverage_90": None}
    text = page(
        {
            "share": 1.0,
            "runs": runs,
            "shipped": {f"{scene} {a}:{b}": some for scene, (a, b) in spans},
            "simple": dict.fromkeys(simple, some),
            "identified": {"mass-elastic": {"parameters": {"mass": one, "bending": one}, "seconds": 1.0}},
        }
    )
    for table in ("II", "III", "IV"):
        of, part = plan()[table], text.split(f"## {table}. ")[1].split("\n## ")[0]
        for one in (run for run in of if run.scene != "kick"):
            assert f"| {one.model} |" in part
    ablations = text.split("## Ablations")[1].split("\n## ")[0]
    assert "| nothing | 2 ± 1 | 200 ± 1e+02 | – | – | 1 | 100 |" in ablations
    assert "| the regression of what is left; the clock of the decoders; the parameters of the decoders |" in ablations
    curve = text.split("## Learning curve")[1].split("\n## ")[0]
    assert "| mass-elastic | 44, RMSE | 44, deformation, % | 88, RMSE |" in curve
    assert "| gp | 1 | 100 | 1 | 100 | 1 | 100 | 1 | 100 |" in curve
    extrapolated = text.split("## III. ")[1].split("\n## ")[0]
    for name in ("odeform", "gp"):
        assert f"| {name} without continuation | 30 | 30 | 30 | 30 | – | – |" in extrapolated
    assert "rnn without continuation" not in extrapolated
    assert "| the true frames of the window, continued | 0.5 | 0.5 | 0.5 | 0.5 | – | – |" in extrapolated
    spread = f"2 ± {np.std([1.0, 2.0, 3.0], ddof=1):.2g}"
    assert text.count(f"| odeform-rolling | 7 | {spread}") == 1
    assert all("| – | – | – |" in row for row in text.splitlines() if row.startswith("| odeform | 7"))
    objects = text.split("## I. ")[1].split("\n## ")[0]
    assert "| bottle | 0.25 | 0.25 | 0.25 | 25 % |" in objects
    assert "| mean | 3.25 | 3.25 | 3.25 | 325 % |" in objects
    assert "| mass-elastic | mass | 0.0100 | – | 1.0 s | 0.113 |" in text


def test_only_a_lead_beyond_the_spread_is_bold() -> None:
    assert _led([[1.0, 1.2], [1.5], []]) == ["**1.1 ± 0.14**", "1.5", "–"]
    assert _led([[1.0, 1.2], [1.2]]) == ["1.1 ± 0.14", "1.2"]
    assert _led([[0.4341], [0.4344]]) == ["0.434", "0.434"]
    assert _led([[0.0], []]) == ["0", "–"]
