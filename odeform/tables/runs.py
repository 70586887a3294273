"""One cell of a table: a model trained as asked, and its scores. Both are kept, so that what was done is not redone.

Where the scores suffice, the checkpoint need not be there any more.
"""

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.evaluation.metrics import evaluate
from odeform.io import atomic_write
from odeform.models.registry import load
from odeform.parallel import as_completed
from odeform.progress import Progress
from odeform.training.request import TrainRequest
from odeform.training.train import train

__all__ = ["Cell", "Result", "run_cells"]

KEPT = ("rmse_pooled_mm", "mae_pooled_mm", "mse_pooled_mm2", "rmse_mm", "deformation_relative", "sequences")

Result = dict[str, Any]
"""`command`, `sha256` of the checkpoint, `parameters`, `scores` by the frames that they are of."""


@dataclass(frozen=True)
class Cell:
    """A model trained on frames 0 to `until` (default: all) of a data set, every k-th of them; scored on `scored`.

    `scored` are half-open windows of frames of the scene's rate; `scene` is a bundled data set or a path. `steps` is
    None for models that are solved for.
    """

    model: str
    scene: str
    scored: tuple[tuple[int, int], ...]
    steps: int | None = None
    seed: int = 0
    every: int = 1
    until: int | None = None
    stagger: bool = False

    @property
    def name(self) -> str:
        parts = [Path(self.scene).name, self.model]
        parts += [f"w{self.until}"] if self.until else []
        parts += [f"e{self.every}"] if self.every > 1 else []
        parts += ["staggered"] if self.stagger else []
        return "_".join([*parts, f"s{self.seed}"])

    @property
    def command(self) -> str:
        return f"odeform train {self.scene}{self.request.command.removeprefix('odeform train DIR --out FILE')}"

    @property
    def request(self) -> TrainRequest:
        window = (0, self.until) if self.until else None
        return TrainRequest(
            self.model, self.seed, steps=self.steps, window=window, every=self.every, stagger=self.stagger
        )


def run_cells(cells: Sequence[Cell], folder: Path, jobs: int, kept_only: bool = False) -> dict[Cell, Result]:
    """Train and score what `folder` does not hold yet, `jobs` at a time; with `kept_only` leave it out."""
    folder.mkdir(parents=True, exist_ok=True)
    cells = list(dict.fromkeys(cells))  # tables share some
    if kept_only:
        cells = [c for c in cells if _scored(c, folder) or _is_of(folder / f"{c.name}.safetensors", c.request)]
    results: dict[Cell, Result] = {}
    progress = Progress("tables", len(cells))
    for index, result in as_completed(partial(_run, folder=folder), cells, jobs):
        results[cells[index]] = result
        progress.advance(note=cells[index].name)
    progress.close()
    return {cell: results[cell] for cell in cells}


def _run(cell: Cell, folder: Path) -> Result:
    """Of one cell, from what is kept as far as that is of this request."""
    if found := _scored(cell, folder):
        return found
    file, kept = folder / f"{cell.name}.safetensors", folder / f"{cell.name}.json"
    request = cell.request
    fine = open_dataset(cell.scene)
    window = fine.schema.window
    # no table asks for what is between the frames of the scene's rate
    dataset = replace(fine, read=lambda entry: fine.read(entry).frames(window.stop, window.rate))
    if not _is_of(file, request):
        with (folder / f"{cell.name}.log").open("w") as log:
            report = partial(print, file=log, flush=True)
            train(dataset, file, **asdict(request), parts=cell.scored, report=report)
    model = load(file)
    known = _read(kept)
    scores = known.get("scores", {}) if known.get("sha256") == model.checkpoint.sha256 else {}
    for span in cell.scored:
        key = f"{span[0]}:{span[1]}"
        if key not in scores:
            found = (model.checkpoint.scores or {}).get(key) or evaluate(model, dataset, "test", span)
            scores[key] = {name: found[name] for name in KEPT}
    result: Result = {
        "command": cell.command,
        "sha256": model.checkpoint.sha256,
        "parameters": (model.checkpoint.scores or {}).get("parameters"),
        "seconds": model.checkpoint.provenance["training_seconds"],
        "scores": scores,
    }
    atomic_write(kept, json.dumps(result, indent=1).encode())
    return result


def _scored(cell: Cell, folder: Path) -> Result | None:
    """What is known of it, if that is all."""
    known = _read(folder / f"{cell.name}.json")
    asked = {f"{first}:{last}" for first, last in cell.scored}
    return known if known.get("command") == cell.command and asked <= known["scores"].keys() else None


def _is_of(file: Path, request: TrainRequest) -> bool:
    """Whether that training has been completed into the file."""
    if not file.exists():
        return False
    try:
        checkpoint = load(file).checkpoint
    except InputError as error:
        print(f"note: {error}; trained anew", file=sys.stderr)
        return False
    return bool(checkpoint.scores) and checkpoint.provenance["command"][-1] == request.command


def _read(file: Path) -> Result:
    return json.loads(file.read_text()) if file.exists() else {}
