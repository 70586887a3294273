"""All tables of the paper, from kept and new runs."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from odeform.checkpoint import read_checkpoint, resolve_checkpoint
from odeform.dataset.index import Dataset
from odeform.dataset.store import open_dataset
from odeform.dataset.subsampling import FrameSubsampling
from odeform.dataset.training_data import prepare
from odeform.evaluation.metrics import evaluate
from odeform.identification.table import identify_split
from odeform.io import atomic_write
from odeform.models.registry import load
from odeform.models.training.continuation import fit_dynamics
from odeform.simulation.scenes.registry import get_scene
from odeform_figures.tables.page import page
from odeform_figures.tables.plan import AHEAD, BALLS, DROP, FINAL, FORCE, FRAMES, IMPACT, INTERVALS, UNTIL, plan
from odeform_figures.tables.runs import KEPT, complete_runs, kept_scores
from odeform_figures.tables.simple import (
    SimplePredictor,
    ballistic,
    continued,
    evaluate_simple,
    hold_last,
    spline_through,
)

__all__ = ["tables"]

Found = dict[str, Any]


def tables(folder: Path, out: Path, fraction: float, jobs: int, kept_only: bool = False) -> None:
    """Write the Markdown page `out`.

    `folder` keeps checkpoints and scores, so that an interrupted call is continued; `jobs` runs are trained at a time.
    `fraction` scales the planned training steps. With `kept_only` nothing is trained and missing entries stay empty.
    """
    planned = plan(fraction)
    results = complete_runs([run for runs in planned.values() for run in runs], folder, jobs, kept_only)
    found = {
        "share": fraction,
        "runs": {table: {run: results[run] for run in runs if run in results} for table, runs in planned.items()},
        "shipped": _kept(folder / "shipped.json", [_sha256(scene) for scene in FRAMES], _shipped),
        "simple": _kept(folder / "simple.json", ["continued", UNTIL, AHEAD, INTERVALS, IMPACT], _simple),
        "identified": _kept(folder / "identified.json", [_sha256(scene) for scene in BALLS], _identified),
    }
    atomic_write(out, page(found).encode())


def _kept(file: Path, key: list[Any], make: Callable[[], Found]) -> Found:
    """The result of `make` for this key, from `file` if it was kept there."""
    key = json.loads(json.dumps(key))
    known = json.loads(file.read_text()) if file.exists() else {}
    if known.get("key") != key:
        known = {"key": key, "found": make()}
        atomic_write(file, json.dumps(known, indent=1).encode())
    return known["found"]


def _sha256(scene: str) -> str:
    return read_checkpoint(resolve_checkpoint(scene)).sha256


def _shipped() -> Found:
    """Scores of the bundled checkpoints, which were trained longer."""
    spans = [(scene, window) for scene, window in FRAMES.items()] + [(DROP, IMPACT), (FORCE, FINAL)]
    scores = {(s, w): evaluate(load(s), open_dataset(s), "test", w) for s, w in spans}
    return {f"{s} {w[0]}:{w[1]}": kept_scores(one) for (s, w), one in scores.items()}


def _simple() -> Found:
    predictors, gravity, dataset = {}, get_scene(DROP).gravity, open_dataset(DROP)
    for until in UNTIL:
        window = until, until + AHEAD
        predictors[f"hold-last {until}:{until + AHEAD}"] = hold_last(until), window
        predictors[f"ballistic {until}:{until + AHEAD}"] = ballistic(until, gravity), window
        predictors[f"continued {until}:{until + AHEAD}"] = _floor(dataset, until), window
    for k in INTERVALS:
        predictors[f"spline {k}"] = spline_through(FrameSubsampling(every=k)), IMPACT
        predictors[f"spline {k} staggered"] = spline_through(FrameSubsampling(every=k, stagger=True)), IMPACT
    scores = {name: evaluate_simple(predict, dataset, "test", window) for name, (predict, window) in predictors.items()}
    return {name: {metric: one[metric] for metric in KEPT} for name, one in scores.items()}


def _floor(dataset: Dataset, until: int) -> SimplePredictor:
    """The continuation behind the true frames: what no error within the window makes worse."""
    data = prepare(dataset, None, FrameSubsampling((0, until)))
    dynamics = fit_dynamics(data.theta["train"], data.reduced["train"], data.space.gyration_radius)
    return continued(until, dynamics, data.space, data.schema)


def _identified() -> Found:
    found = {scene: identify_split(load(scene), open_dataset(scene)) for scene in BALLS}
    return {scene: {key: one[key] for key in ("parameters", "seconds")} for scene, one in found.items()}
