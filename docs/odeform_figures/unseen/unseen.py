"""How well a mechanical model moves shapes that it was not trained on, against the simulator on these very shapes."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from odeform.checkpoint import read_checkpoint, resolve_checkpoint, write_checkpoint
from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.models.modal.shape_band import SHAPE_BAND, ShapeErrors, calibrated_shape_band, coverages_left_out
from odeform.models.modal.user_body import UserBodyPredictor, resting_body, takes_user_bodies
from odeform.models.per_object import PerObject
from odeform.models.registry import load
from odeform.simulation.errors import SimulationError
from odeform_figures.unseen.instances import factors_of
from odeform_figures.unseen.left_out import left_out_shape, without
from odeform_figures.unseen.measure import Measured, measure
from odeform_figures.unseen.shapes import (
    BY_CODE,
    INSTANCE,
    LEFT_OUT,
    SCAN,
    UnseenShape,
    by_code,
    codes,
    instance,
    scan,
    shape_file,
    simulated,
    taught,
)

__all__ = ["Plan", "attach_band", "unseen"]

BARS = {INSTANCE: 1.5, SCAN: 2.5, BY_CODE: 2.5, LEFT_OUT: 4.0}
FEWEST = 4  # shapes of which one is left out in turn


@dataclass(frozen=True)
class Plan:
    """Settings of what is measured."""

    keep: Path
    """Folder of simulated motions; what it holds is not made again."""
    pushes: int = 10
    """Number of pushes of each shape."""
    seed: int = 0
    objects: tuple[str, ...] = ()
    """Classes with other instances; none: those of the model."""
    instances: bool = True
    """Whether other instances of classes are measured."""
    code: bool = False
    """Whether shapes that are made by code (`odeform_figures.bodies.hard`) are measured."""
    scans: tuple[Path, ...] = ()
    folders: tuple[Path, ...] = ()
    """Folders of a body of one's own with motions that are simulated already."""
    data: str | None = None
    """Training data, to leave one class out; None: this is not measured."""
    workers: int | None = None
    kept_only: bool = False
    """Whether shapes that the folder does not hold are left out instead of made."""


def unseen(checkpoint: str | Path, plan: Plan) -> dict[str, Any]:
    """Measure a checkpoint on unseen shapes: rows by shape, means by kind, and the error band that follows.

    Raises:
        InputError: A model that knows trained bodies only, or a scan that is no solid.
    """
    trained = load(checkpoint)
    if not isinstance(trained, PerObject) or not takes_user_bodies(trained):
        raise InputError(f"checkpoint {checkpoint}: expected a mechanical model of several objects")
    seen = trained.checkpoint.scores["per_object"]
    found: list[Measured] = []
    failed: dict[str, list[str]] = {}
    for shape, model in _shapes(trained, plan, failed):
        if shape.motions:
            found.append(_measured(model, shape))
        else:
            failed[shape.name] = list(shape.failed)
    if not found:
        raise InputError(f"{plan.keep}: expected finished shapes with motions, found none")
    rows = {one.shape.name: one.to_json(seen[_class_of(one.shape)]) for one in found}
    errors = [ShapeErrors(one.distance, np.sqrt((one.predicted**2).mean(axis=1)), one.errors) for one in found]
    times = trained.schema.window.times[1:]
    covered = coverages_left_out(errors, times) if len(errors) >= FEWEST else []
    band = replace(calibrated_shape_band(errors, times), covered=float(np.mean(covered)) if covered else 0.0)
    return {
        "checkpoint": trained.checkpoint.sha256,
        "pushes": plan.pushes,
        "seed": plan.seed,
        "shapes": rows,
        "not_simulated": failed,
        "kinds": {kind: _mean([row for row in rows.values() if row["kind"] == kind]) for kind in BARS},
        "coverage_90": dict(zip(rows, covered, strict=True)) if covered else None,
        SHAPE_BAND: band.to_json(),
    }


def attach_band(checkpoint: str | Path, result: dict[str, Any]) -> None:
    """Store the error band of a result of `unseen` in the checkpoint, which is written anew."""
    path = resolve_checkpoint(str(checkpoint))
    found = read_checkpoint(path)
    write_checkpoint(path, replace(found, config={**found.config, SHAPE_BAND: result[SHAPE_BAND]}))


def _shapes(trained: PerObject, plan: Plan, failed: dict[str, list[str]]) -> Iterator[tuple[UnseenShape, PerObject]]:
    """All shapes with their motions, and the model that has not seen them. Why a shape is no body is added to
    `failed`."""
    for name in (plan.objects or tuple(trained.parts)) if plan.instances else ():
        for key, factors in factors_of(name).items():
            if _wanted(plan, _file(plan, key)):
                yield _kept(plan, key, partial(instance, key, name, factors)), trained
    own: dict[str, Callable[[], UnseenShape]] = {path.stem: partial(scan, path) for path in plan.scans}
    own |= {key: partial(by_code, key, name) for key, name in (codes() if plan.code else {}).items()}
    for key, make in own.items():
        if _wanted(plan, _file(plan, key)):
            try:
                shape = _kept(plan, key, make)
            except (InputError, SimulationError) as error:
                failed[key] = [str(error)]
            else:
                yield shape, trained
    for folder in plan.folders:
        yield taught(folder), trained
    if plan.data is not None:
        dataset = open_dataset(plan.data)
        for name in trained.parts:
            model = without(trained, name)
            yield left_out_shape(dataset, name, model), model


def _file(plan: Plan, key: str) -> Path:
    return shape_file(plan.keep, key, plan.pushes, plan.seed)


def _wanted(plan: Plan, path: Path) -> bool:
    return path.exists() or not plan.kept_only


def _kept(plan: Plan, key: str, make: Callable[[], UnseenShape]) -> UnseenShape:
    return simulated(_file(plan, key), make, plan.pushes, plan.seed, plan.workers)


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
