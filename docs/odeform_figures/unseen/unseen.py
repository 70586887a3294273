"""How well a mechanical model moves shapes that it was not trained on, against the simulator on these very shapes."""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from odeform.checkpoint import read_checkpoint, resolve_checkpoint, write_checkpoint
from odeform.dataset.index import Dataset
from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.io import atomic_write
from odeform.mechanics.contact_parameters import ContactParameters
from odeform.models.modal.shape_band import SHAPE_BAND, ShapeErrors, coverage, fit_shape_band
from odeform.models.modal.user_body import UserBodyPredictor, resting_body, takes_user_bodies
from odeform.models.per_object import PerObject
from odeform.models.registry import load
from odeform_figures.unseen.instances import factors_of
from odeform_figures.unseen.left_out import contact_parameters_without, left_out_shape, without
from odeform_figures.unseen.measure import Measured, measure
from odeform_figures.unseen.shapes import INSTANCE, LEFT_OUT, SCAN, UnseenShape, instance, scan, shape_file, simulated

__all__ = ["Plan", "attach_band", "unseen"]

BARS = {INSTANCE: 1.5, SCAN: 2.5, LEFT_OUT: 4.0}
HALVES = 50  # random halves of the shapes on which the error band is fitted, and its coverage measured on the others


@dataclass(frozen=True)
class Plan:
    """Settings of what is measured."""

    keep: Path
    """Folder of simulated motions and contact parameters; what it holds is not made again."""
    pushes: int = 10
    """Number of pushes of each shape."""
    seed: int = 0
    objects: tuple[str, ...] = ()
    """Classes with other instances; none: those of the model."""
    scans: tuple[Path, ...] = ()
    data: str | None = None
    """Training data, to leave one class out; None: this is not measured."""
    workers: int | None = None
    kept_only: bool = False
    """Whether shapes and contact parameters that the folder does not hold are left out instead of made."""


def unseen(checkpoint: str | Path, plan: Plan) -> dict[str, Any]:
    """Measure a checkpoint on unseen shapes: rows by shape, means by kind, and the error band that follows.

    Raises:
        InputError: A model that knows trained bodies only, or a scan that is no solid.
    """
    trained = load(checkpoint)
    if not isinstance(trained, PerObject) or not takes_user_bodies(trained):
        raise InputError(f"checkpoint {checkpoint}: expected a mechanical model of several objects")
    seen = trained.checkpoint.scores["per_object"]
    found, failed = [], {}
    for shape, model in _shapes(trained, plan):
        if shape.motions:
            found.append(_measured(model, shape))
        else:
            failed[shape.name] = list(shape.failed)
    if not found:
        raise InputError(f"{plan.keep}: expected finished shapes with motions, found none")
    rows = {one.shape.name: one.to_json(seen[_class_of(one.shape)]) for one in found}
    errors = [ShapeErrors(one.distance, np.sqrt((one.predicted**2).mean(axis=1)), one.errors) for one in found]
    times = trained.schema.window.times[1:]
    return {
        "checkpoint": trained.checkpoint.sha256,
        "pushes": plan.pushes,
        "seed": plan.seed,
        "shapes": rows,
        "not_simulated": failed,
        "kinds": {kind: _mean([row for row in rows.values() if row["kind"] == kind]) for kind in BARS},
        "coverage_90": _held_out_coverage(errors, times),
        SHAPE_BAND: fit_shape_band(errors, times).to_json(),
    }


def attach_band(checkpoint: str | Path, result: dict[str, Any]) -> None:
    """Store the error band of a result of `unseen` in the checkpoint, which is written anew."""
    path = resolve_checkpoint(str(checkpoint))
    found = read_checkpoint(path)
    write_checkpoint(path, replace(found, config={**found.config, SHAPE_BAND: result[SHAPE_BAND]}))


def _shapes(trained: PerObject, plan: Plan) -> Iterator[tuple[UnseenShape, PerObject]]:
    """All shapes with their motions, and the model that has not seen them."""
    for name in plan.objects or tuple(trained.parts):
        for key, factors in factors_of(name).items():
            if _wanted(plan, _file(plan, key)):
                yield _kept(plan, key, partial(instance, key, name, factors)), trained
    for path in plan.scans:
        if _wanted(plan, _file(plan, path.stem)):
            yield _kept(plan, path.stem, partial(scan, path)), trained
    if plan.data is not None:
        dataset = open_dataset(plan.data)
        for name in trained.parts:
            path = plan.keep / f"law-without-{name}.json"
            if _wanted(plan, path):
                model = without(trained, name, _contact_parameters(trained, dataset, name, path))
                yield left_out_shape(dataset, name, model), model


def _file(plan: Plan, key: str) -> Path:
    return shape_file(plan.keep, key, plan.pushes, plan.seed)


def _wanted(plan: Plan, path: Path) -> bool:
    return path.exists() or not plan.kept_only


def _kept(plan: Plan, key: str, make: Callable[[], UnseenShape]) -> UnseenShape:
    return simulated(_file(plan, key), make, plan.pushes, plan.seed, plan.workers)


def _contact_parameters(trained: PerObject, dataset: Dataset, name: str, path: Path) -> ContactParameters:
    if not path.exists():
        contact_parameters = contact_parameters_without(trained, dataset, name, print)
        atomic_write(path, json.dumps(contact_parameters.to_json(), indent=1).encode())
    return ContactParameters.from_json(json.loads(path.read_text()))


def _measured(model: PerObject, shape: UnseenShape) -> Measured:
    return measure(UserBodyPredictor(model, resting_body(shape.item, shape.like)), model, shape)


def _class_of(shape: UnseenShape) -> str:
    """The object whose error on trained shapes a shape's error is compared with."""
    return shape.name if shape.kind == LEFT_OUT else shape.like


def _mean(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Over the shapes of one kind."""
    if not rows:
        return {"shapes": 0}
    ratios, relative = ([row[key] for row in rows] for key in ("ratio", "relative_ratio"))
    return {
        "shapes": len(rows),
        "bar": BARS[rows[0]["kind"]],
        "mean_ratio": float(np.mean(ratios)),
        "largest_ratio": float(np.max(ratios)),
        "mean_relative_ratio": float(np.mean(relative)),
        "better_than_nearest": sum(row["model_mm"] < row["nearest_mm"] for row in rows),
        "better_than_rigid": sum(row["model_mm"] <= row["rigid_mm"] for row in rows),
    }


def _held_out_coverage(errors: Sequence[ShapeErrors], times: np.ndarray) -> dict[str, float] | None:
    """Coverage of bands that are fitted on a random half of the shapes, on the other half; None for few shapes."""
    if len(errors) < 4:
        return None
    rng, found = np.random.default_rng(0), []
    for _ in range(HALVES):
        order = rng.permutation(len(errors))
        one, other = ([errors[at] for at in part] for part in np.array_split(order, 2))
        found.append(coverage(fit_shape_band(one, times), other))
    low, high = np.quantile(found, [0.1, 0.9])
    return {"mean": float(np.mean(found)), "p10": float(low), "p90": float(high)}
