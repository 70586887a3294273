"""Does one network that reads shapes move one that was left out? `python -m odeform_figures.studies.one_network`.

Trains `odeform-shapes` on all objects of `contact-force`, then without each of them in turn, and scores the test pushes
of the object that was left out, beside the modal model that has not seen it either.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from odeform.checkpoint import Checkpoint, read_checkpoint, write_checkpoint
from odeform.dataset.index import Dataset
from odeform.dataset.store import open_dataset
from odeform.evaluation.metrics import evaluate
from odeform.models.modal.user_body import UserBodyPredictor, resting_body
from odeform.models.per_object import PerObject
from odeform.models.points.shape_inputs import Body, body_of
from odeform.models.points.shape_model import ShapeModel
from odeform.models.points.shape_trajectory import ShapePush
from odeform.models.points.training.shape_data import ShapeData, prepare_shapes
from odeform.models.points.training.shape_fit import fit_shapes
from odeform.models.registry import load
from odeform.models.training.body import body_arrays
from odeform.models.training.request import TrainRequest
from odeform.models.training.run import Run
from odeform.schema import OBJECT, Parameters
from odeform.simulation.objects.catalog import get_object
from odeform.training.train import provenance_of, scored
from odeform_figures.output import write_or_print
from odeform_figures.unseen.left_out import left_out_shape, without
from odeform_figures.unseen.measure import measure
from odeform_figures.unseen.shapes import UnseenShape

__all__ = ["OfAnotherShape", "Plan", "main", "measured", "study", "train_each", "with_left_out"]

SCENE, MODEL = "contact-force", ShapeModel.model
FILE_OF_ALL = "odeform-shapes.safetensors"
SCORES = ("rmse_pooled_mm", "median_mm", "relative", "deformation_relative")


@dataclass(frozen=True)
class Plan:
    """What is trained, and where it is kept."""

    keep: Path
    """Folder of checkpoints and scores; what it holds is not made again."""
    minutes: float
    """Of processor time for the network of all objects."""
    left_out_minutes: float
    """Of processor time for each network without one."""
    steps: int | None = None
    """Steps of each training, in place of minutes."""
    seed: int = 0


def train_each(dataset: Dataset, plan: Plan) -> dict[str, Checkpoint]:
    """The network of all objects, as "", and those without one, by its name."""
    names = ("", *dataset.objects)
    files = {name: plan.keep / (f"without-{name}.safetensors" if name else FILE_OF_ALL) for name in names}
    plan.keep.mkdir(parents=True, exist_ok=True)
    data = None if all(file.exists() for file in files.values()) else prepare_shapes(dataset)
    for name, file in files.items():
        if not file.exists():
            assert data is not None
            write_checkpoint(file, _trained(dataset, data, name, plan))
    return {name: read_checkpoint(file) for name, file in files.items()}


def _trained(dataset: Dataset, data: ShapeData, left_out: str, plan: Plan) -> Checkpoint:
    if left_out:
        data = data.without(left_out)
        dataset = dataset.of(*data.bodies)
    minutes = plan.left_out_minutes if left_out else plan.minutes
    request = TrainRequest(MODEL, plan.seed, minutes, plan.steps, objects=tuple(data.bodies))

    def report(line: str) -> None:
        print(f"{f'without {left_out}' if left_out else 'all'}: {line}", flush=True)

    checkpoint = fit_shapes(data, Run(dataset, request, body_arrays(dataset), None, report))
    known = provenance_of(dataset, request, checkpoint.config["val"]["seconds"])
    return replace(checkpoint, provenance=known)


def with_left_out(checkpoint: Checkpoint, name: str) -> ShapeModel:
    """A network that was trained without an object of the scene, asked to move it. `InputError` if it was trained on
    it."""
    item = get_object(name)
    return ShapeModel(checkpoint).with_body(name, item.rest_mesh(), item.mass, item.material.young)


class OfAnotherShape(ShapeModel):
    """The network whose encoders are shown the next object, as large as the one that is moved, in place of it."""

    def push(self, body: Body, parameters: Parameters) -> ShapePush:
        names = self.schema.objects
        other = names[(names.index(parameters[OBJECT]) + 1) % len(names)]
        shown = body_of(self.rest_of({OBJECT: other}), body.mass, body.young)
        points = body.centre + (shown.points - shown.centre) * (body.gyration_radius / shown.gyration_radius)
        return super().push(replace(body, points=points, areas=shown.areas), parameters)


def measured(dataset: Dataset, checkpoints: Mapping[str, Checkpoint], name: str) -> dict[str, Any]:
    """The scores on the test pushes of an object, of the network that was trained on it and of that which was not; and
    pooled RMSEs in mm on its first pushes, as `odeform unseen` has them, beside those of the modal model without it."""
    modal = load(SCENE)
    assert isinstance(modal, PerObject)
    rest = without(modal, name)
    shape = left_out_shape(dataset, name, rest)
    mechanics = measure(UserBodyPredictor(rest, resting_body(shape.item, shape.like)), rest, shape)
    network, whole = with_left_out(checkpoints[name], name), checkpoints[""]
    val = checkpoints[name].config["val"]
    return {
        "val_rmse_mm": val["val_rmse_mm"],
        "steps": val["steps"],
        "left out": _some(evaluate(network, dataset.of(name))),
        "trained": _some(whole.scores["per_object"][name]),
        "first pushes": {
            "pushes": len(shape.motions),
            "like": shape.like,
            "network_left_out_mm": _pooled(network, shape),
            "network_trained_mm": _pooled(ShapeModel(whole), shape),
            "network_of_another_shape_mm": _pooled(OfAnotherShape(whole), shape),
            **{key: mechanics.pooled[key] for key in ("moved_mm", "model_mm", "rigid_mm", "nearest_mm")},
        },
    }


def _pooled(predictor: ShapeModel, shape: UnseenShape) -> float:
    """mm: the pooled RMSE over the motions of an object, without frame 0."""
    squares = []
    for motion in shape.motions:
        given = {**motion.parameters, OBJECT: shape.name}
        error = predictor.solve(motion.rest, given).vertices(motion.times) - motion.vertices.astype(float)
        squares.append(np.square(error[1:]).mean())
    return 1e3 * float(np.sqrt(np.mean(squares)))


def _some(scores: Mapping[str, Any]) -> dict[str, Any]:
    return {key: scores[key] for key in SCORES}


def study(dataset: Dataset, plan: Plan) -> dict[str, Any]:
    """Trains and measures what the folder does not hold."""
    trained = train_each(dataset, plan)
    if not trained[""].scores:
        trained[""] = scored(trained[""], dataset)
        write_checkpoint(plan.keep / FILE_OF_ALL, trained[""])
    mean = trained[""].scores["mean_of_objects"]
    rows = {}
    for name in dataset.objects:
        kept = plan.keep / f"{name}.json"
        if not kept.exists():
            write_or_print(measured(dataset, trained, name), str(kept))
        rows[name] = json.loads(kept.read_text())
    return {
        "minutes": plan.minutes,
        "left_out_minutes": plan.left_out_minutes,
        "val": trained[""].config["val"],
        "trained": {**_some(mean), "rmse_pooled_95": mean["rmse_pooled_95"]},
        "objects": rows,
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Train what is not there yet, and measure."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.studies.one_network", description=__doc__)
    parser.add_argument("--keep", required=True, metavar="FOLDER", help="folder of checkpoints and scores")
    parser.add_argument("--minutes", type=float, default=5.0, metavar="M", help="of the network of all (default: 5)")
    parser.add_argument(
        "--left-out-minutes", type=float, default=1.5, metavar="M", help="of each network without one (default: 1.5)"
    )
    parser.add_argument("--steps", type=int, metavar="N", help="steps of each, in place of minutes")
    parser.add_argument("--json", metavar="FILE", help="file to write; else the figures are printed")
    args = parser.parse_args(arguments)
    plan = Plan(Path(args.keep), args.minutes, args.left_out_minutes, args.steps)
    write_or_print(study(open_dataset(SCENE), plan), args.json)


if __name__ == "__main__":
    main()
