"""Training runs behind the tables. Checkpoints and scores are kept in a folder, and finished runs are not repeated.

A checkpoint may be deleted once its scores are complete.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.evaluation.metrics import evaluate
from odeform.io import atomic_write
from odeform.models.continuation import without_continuation
from odeform.models.reduced_model import ReducedModel
from odeform.models.registry import load
from odeform.models.training.request import TrainRequest
from odeform.parallel import as_completed
from odeform.progress import Progress
from odeform.training.train import train

__all__ = ["ALONE", "KEPT", "Result", "Run", "complete_runs", "kept_scores"]

KEPT = ("rmse_pooled_mm", "mae_pooled_mm", "mse_pooled_mm2", "rmse_mm", "deformation_relative", "sequences")

ALONE = " alone"
"""After a window of frames: the scores of the model without what continues it beyond its trained window."""

Result = dict[str, Any]
"""`command`, `sha256` of the checkpoint, number of `parameters`, training `seconds`, and `scores` by "FIRST:LAST"."""


@dataclass(frozen=True)
class Run:
    """A model trained on every k-th of the frames 0 to `until` (default: all) of a data set, and scored on `scored`.

    `scored` are half-open windows of frames at the scene's rate; `scene` is a bundled data set or a path. `steps` is
    None for models without iterative training. `sequences`, `without` and `objects` are
    those of `TrainRequest`.
    """

    model: str
    scene: str
    scored: tuple[tuple[int, int], ...]
    steps: int | None = None
    seed: int = 0
    every: int = 1
    until: int | None = None
    stagger: bool = False
    sequences: int | None = None
    without: tuple[str, ...] = ()
    objects: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of its files, unique within a folder."""
        parts = [Path(self.scene).name, self.model]
        parts += [f"w{self.until}"] if self.until else []
        parts += [f"e{self.every}"] if self.every > 1 else []
        parts += ["staggered"] if self.stagger else []
        parts += [f"n{self.sequences}"] if self.sequences else []
        parts += [f"no-{name}" for name in self.without]
        parts += self.objects
        return "_".join([*parts, f"s{self.seed}"])

    @property
    def command(self) -> str:
        """The command that repeats the training."""
        return f"odeform train {self.scene}{self.request.command.removeprefix('odeform train DIR --out FILE')}"

    @property
    def request(self) -> TrainRequest:
        """Returns what to ask of the trainer."""
        window = (0, self.until) if self.until else None
        shared = {name: getattr(self, name) for name in ("model", "seed", "steps", "every", "stagger")}
        kept = {name: getattr(self, name) for name in ("sequences", "without", "objects")}
        return TrainRequest(**shared, **kept, window=window)


def complete_runs(runs: Sequence[Run], folder: Path, jobs: int, kept_only: bool = False) -> dict[Run, Result]:
    """Train and score the runs that `folder` does not hold yet, `jobs` at a time; with `kept_only`, leave them out."""
    folder.mkdir(parents=True, exist_ok=True)
    runs = list(dict.fromkeys(runs))  # tables share some of them
    if kept_only:
        runs = [r for r in runs if _scored(r, folder) or _is_of(folder / f"{r.name}.safetensors", r.request)]
    results: dict[Run, Result] = {}
    progress = Progress("tables", len(runs))
    for index, result in as_completed(partial(_complete, folder=folder), runs, jobs):
        results[runs[index]] = result
        progress.advance(note=runs[index].name)
    progress.close()
    return {run: results[run] for run in runs}


def _complete(run: Run, folder: Path) -> Result:
    """The result of one run. What `folder` holds is used if it comes from the same request."""
    if found := _scored(run, folder):
        return found
    file, kept = folder / f"{run.name}.safetensors", folder / f"{run.name}.json"
    request = run.request
    fine = open_dataset(run.scene)
    window = fine.schema.window
    # no table scores frames between those of the scene's rate
    dataset = replace(fine, read=lambda entry: fine.read(entry).frames(window.stop, window.rate))
    if not _is_of(file, request):
        with (folder / f"{run.name}.log").open("w") as log:
            report = partial(print, file=log, flush=True)
            train(dataset, file, **asdict(request), parts=run.scored, report=report)
    model = load(file)
    known = _read(kept)
    scores = known.get("scores", {}) if known.get("sha256") == model.checkpoint.sha256 else {}
    for span in run.scored:
        key = f"{span[0]}:{span[1]}"
        if key not in scores:
            known_scores = {} if dataset.objects else model.checkpoint.scores or {}
            scores[key] = kept_scores(known_scores.get(key) or evaluate(model, dataset, "test", span))
        continued = run.until is not None and isinstance(model, ReducedModel) and model.dynamics is not None
        if continued and f"{key}{ALONE}" not in scores:
            alone = type(model)(without_continuation(model.checkpoint))
            scores[f"{key}{ALONE}"] = kept_scores(evaluate(alone, dataset, "test", span))
    result: Result = {
        "command": run.command,
        "sha256": model.checkpoint.sha256,
        "parameters": (model.checkpoint.scores or {}).get("parameters"),
        "seconds": model.checkpoint.provenance["training_seconds"],
        "scores": scores,
    }
    atomic_write(kept, json.dumps(result, indent=1).encode())
    return result


def kept_scores(found: Mapping[str, Any]) -> Result:
    """The scores that tables show. In a scene with objects: their means, and those of each under `objects`."""
    each = found.get("per_object")
    if not each:
        return {name: found[name] for name in KEPT}
    means = {name: float(np.mean([one[name] for one in each.values()])) for name in KEPT}
    return {**means, "objects": {name: kept_scores(one) for name, one in each.items()}}


def _scored(run: Run, folder: Path) -> Result | None:
    """The kept result, or None where scores are missing."""
    known = _read(folder / f"{run.name}.json")
    needed = {f"{first}:{last}" for first, last in run.scored}
    return known if known.get("command") == run.command and needed <= known["scores"].keys() else None


def _is_of(file: Path, request: TrainRequest) -> bool:
    """Whether `file` is the completed checkpoint of this request."""
    if not file.exists():
        return False
    try:
        checkpoint = load(file).checkpoint
    except InputError as error:
        print(f"note: {error}; training again", file=sys.stderr)
        return False
    return bool(checkpoint.scores) and checkpoint.provenance["command"][-1] == request.command


def _read(file: Path) -> Result:
    return json.loads(file.read_text()) if file.exists() else {}
