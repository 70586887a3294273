"""Cells of tables are trained once and kept; the page shows what there is."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from odeform.checkpoint import read_checkpoint, write_checkpoint
from odeform.dataset.index import Dataset
from odeform.evaluation.metrics import evaluate
from odeform.models.registry import load
from odeform.tables.page import page
from odeform.tables.plan import AHEAD, FRAMES, IMPACT, INTERVALS, UNTIL, plan
from odeform.tables.runs import KEPT, Cell, Result, run_cells


@pytest.fixture(scope="module")
def cell(dataset: Dataset) -> Cell:
    return Cell("nearest", str(dataset.root), ((0, 121), (60, 70)))


@pytest.fixture(scope="module")
def folder(cell: Cell, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("cells")
    run_cells([cell, replace(cell, every=4, stagger=True)], out, jobs=2)
    return out


def test_scores_are_those_of_the_checkpoint(cell: Cell, folder: Path, dataset: Dataset) -> None:
    result = run_cells([cell], folder, 1)[cell]
    model = load(folder / f"{cell.name}.safetensors")
    assert result["sha256"] == model.checkpoint.sha256
    again = evaluate(model, dataset, "test", (60, 70))
    # positions are rounded to single precision, in products of other sizes
    assert result["scores"]["60:70"] == pytest.approx({name: again[name] for name in KEPT}, rel=1e-5)
    assert "odeform train" in result["command"]


def test_what_is_kept_is_not_done_again(cell: Cell, folder: Path) -> None:
    def written() -> dict[str, int]:
        return {file.name: file.stat().st_mtime_ns for file in folder.glob("*.safetensors")}

    before = written()
    run_cells([cell], folder, 1)
    assert written() == before
    assert len(before) == 2


def test_scores_suffice(cell: Cell, folder: Path) -> None:
    file = folder / f"{cell.name}.safetensors"
    whole = file.read_bytes()
    file.unlink()
    found = run_cells([cell], folder, 1, kept_only=True)[cell]
    assert found["scores"].keys() == {"0:121", "60:70"}
    assert not file.exists()
    # but not where others are asked for
    assert run_cells([replace(cell, scored=((0, 60),))], folder, 1, kept_only=True) == {}
    file.write_bytes(whole)


def test_an_interrupted_cell_is_trained_anew(cell: Cell, folder: Path) -> None:
    file = folder / f"{cell.name}.safetensors"
    whole = read_checkpoint(file)
    write_checkpoint(file, replace(whole, scores={}))
    file.with_suffix(".json").unlink()
    assert run_cells([cell], folder, 1, kept_only=True) == {}
    run_cells([cell], folder, 1)
    assert read_checkpoint(file).scores == whole.scores


def test_sparse_frames_score_worse(cell: Cell, folder: Path) -> None:
    sparse = replace(cell, every=4, stagger=True)
    found = run_cells([cell, sparse], folder, 1, kept_only=True)
    one, other = (found[c]["scores"]["0:121"]["deformation_relative"] for c in (cell, sparse))
    assert other > one


def test_the_page_shows_every_model_and_leaves_open_what_is_not_there() -> None:
    def result(cell: Cell) -> Result:
        scores = {f"{a}:{b}": dict.fromkeys(KEPT, 1.0 + cell.seed) for a, b in cell.scored}
        return {"command": cell.name, "sha256": "", "parameters": 7, "seconds": 1.0, "scores": scores}

    some = dict.fromkeys(KEPT, 0.5)
    spans = [*FRAMES.items(), ("mass-elastic", IMPACT)]
    simple = [f"{name} {u}:{u + AHEAD}" for name in ("hold-last", "ballistic") for u in UNTIL]
    simple += [f"spline {k}{way}" for k in INTERVALS for way in ("", " staggered")]
    cells = {table: {c: result(c) for c in of if c.scene != "kick"} for table, of in plan().items()}
    one = {"mae_normalised": 0.01, "coverage_90": None}
    text = page(
        {
            "share": 1.0,
            "cells": cells,
            "shipped": {f"{scene} {a}:{b}": some for scene, (a, b) in spans},
            "simple": dict.fromkeys(simple, some),
            "identified": {"mass-elastic": {"parameters": {"mass": one, "bending": one}, "seconds": 1.0}},
        }
    )
    for table, of in plan().items():
        part = text.split(f"## {table}. ")[1].split("\n## ")[0]
        for cell in of:
            assert f"| {cell.model} |" in part or f"| **{cell.model}** |" in part
    spread = f"2 ± {np.std([1.0, 2.0, 3.0], ddof=1):.2g}"
    assert text.count(f"| **odeform** | 7 | {spread}") == 1
    assert all(row.endswith("| – | – | – |") for row in text.splitlines() if row.startswith("| **odeform** | 7"))
    assert "| mass-elastic | mass | 0.0100 | – | 1.0 s | 0.113 |" in text
