"""What is a longer training worth to a network of points? `python -m odeform_figures.studies.budgets MODEL` trains it.

One network an object, all objects at once, on a GPU if there is one. Trials and final training are those of
`odeform train contact-force --model MODEL --steps N`, to rounding. Writes FOLDER/MODEL-N.safetensors for each N, as
that command would, and prints the errors on validation.
"""

import argparse
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, replace
from itertools import groupby
from pathlib import Path
from typing import Any

from odeform.checkpoint import Checkpoint, write_checkpoint
from odeform.dataset.index import Dataset
from odeform.dataset.store import open_dataset
from odeform.dataset.subsampling import FrameSubsampling
from odeform.models.per_object import joined
from odeform.models.points.point_model import PointModel
from odeform.models.points.training.fit import BETWEEN, FRACTION, network_checkpoint
from odeform.models.points.training.point_data import prepare_points
from odeform.models.registry import model_class
from odeform.models.training.body import body_arrays
from odeform.models.training.descent import Budget, descend, small_batches
from odeform.models.training.loss import torch_device
from odeform.models.training.request import TrainRequest
from odeform.models.training.run import Run, with_ranges_of_data
from odeform.training.train import provenance_of, scored
from odeform.types import Arrays
from odeform_figures.studies.stacked import Lane, Stacked

__all__ = ["Bodies", "main"]


class Bodies:
    """The objects of a data set, and the networks that are trained for them. Stacks are kept from budget to budget."""

    def __init__(self, model: str, dataset: Dataset, seed: int = 0, device: str | None = None) -> None:
        """`InputError` for a model that is not a network of points, or a device that is not there."""
        kind = model_class(model)
        assert issubclass(kind, PointModel)
        self.model, self.seed, self.network = model, seed, kind.network
        self._dataset, self.objects = dataset, dataset.objects
        self._device = torch_device(device)
        self._sets = [with_ranges_of_data(dataset.of(name)) for name in dataset.objects]
        self._data = [prepare_points(each, FrameSubsampling()) for each in self._sets]
        self._stacks: dict[tuple[Lane, ...], Stacked] = {}

    def train(self, steps: int) -> Checkpoint:
        """The checkpoint of all objects after `steps` steps in all, an equal share for each, trials included."""
        network, begin = self.network, time.process_time()
        budget = Budget(0.0, max(steps // len(self.objects), 1))
        whole = 1.0 / (1.0 + FRACTION * len(network.trials))
        bodies = range(len(self.objects))
        tried = self._descend(
            [Lane(body, trial) for trial in network.trials for body in bodies], budget.part(FRACTION * whole)
        )
        trials = [[tried[Lane(body, trial)][0] for trial in network.trials] for body in bodies]
        best = [network.trials[min(range(len(errors)), key=errors.__getitem__)] for errors in trials]
        found = self._descend([Lane(body, trial) for body, trial in enumerate(best)], budget.part(whole))
        seconds = time.process_time() - begin
        parts = {}
        for body, name in enumerate(self.objects):
            error, weights, done = found[Lane(body, best[body])]
            known = [asdict(trial) | {"val": each} for trial, each in zip(network.trials, trials[body], strict=True)]
            val = {"val_rmse_mm": error, "steps": done, "seconds": seconds / len(self.objects)}
            config = {**asdict(best[body]), "every": 1, "trials": known, "val": val}
            parts[name] = self._checkpoint(body, weights, config)
        known = provenance_of(self._dataset, TrainRequest(self.model, self.seed, steps=steps), seconds)
        made = joined(self._dataset.schema, parts)
        return replace(made, provenance={**known, **made.provenance})

    def _descend(self, lanes: Iterable[Lane], budget: Budget) -> dict[Lane, tuple[float, Arrays, int]]:
        """Best error in mm and weights of each lane, and its steps."""
        found = {}
        for width, group in groupby(sorted(lanes, key=_width), key=_width):
            some = tuple(group)
            if some not in self._stacks:
                self._stacks[some] = Stacked(self.network, self._data, some, self.seed, self._device)
            stack = self._stacks[some]
            stack.restart()
            title = f"{self.model}, {len(some)} networks of width {width}"
            descend(stack, budget, lambda line, title=title: print(f"{title}: {line}", flush=True), between=BETWEEN)
            found |= {lane: (float(stack.best[i]), stack.weights(i), stack.done) for i, lane in enumerate(some)}
        return found

    def _checkpoint(self, body: int, weights: Arrays, config: dict[str, Any]) -> Checkpoint:
        data, dataset = self._data[body], self._sets[body]
        checkpoint = network_checkpoint(self.model, self.network, data, weights, config)
        run = Run(dataset, TrainRequest(self.model, self.seed), body_arrays(dataset), None, print)
        return replace(checkpoint, arrays=run.with_body(checkpoint.arrays, data.theta["train"]))


def _width(lane: Lane) -> int:
    return lane.trial.width


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study from the command line."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.studies.budgets", description=__doc__)
    parser.add_argument("model", metavar="MODEL", help="odeform-per-point, rnn, node, or another network of points")
    parser.add_argument(
        "--steps", type=int, nargs="+", required=True, metavar="N", help="steps of all objects together"
    )
    parser.add_argument("--object", nargs="+", metavar="NAME", help="these objects only")
    parser.add_argument("--keep", default=".", metavar="FOLDER", help="where checkpoints are written (default: here)")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="random seed (default: 0)")
    parser.add_argument("--device", metavar="NAME", help="as PyTorch names it (default: a GPU if there is one)")
    args = parser.parse_args(arguments)
    dataset = open_dataset("contact-force")
    dataset = dataset.of(*args.object) if args.object else dataset
    bodies = Bodies(args.model, dataset, args.seed, args.device)
    folder = Path(args.keep)
    folder.mkdir(parents=True, exist_ok=True)
    with small_batches():
        for steps in args.steps:
            checkpoint = bodies.train(steps)
            parts = checkpoint.config["objects"]
            line = ", ".join(f"{name} {part['val']['val_rmse_mm']:.3f}" for name, part in parts.items())
            print(f"{args.model}, {steps} steps: {line} mm (val)", flush=True)
            write_checkpoint(folder / f"{args.model}-{steps}.safetensors", scored(checkpoint, dataset))


if __name__ == "__main__":
    main()
