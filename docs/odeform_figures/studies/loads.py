"""Loads of the seven objects: how they meet the floor is fitted, and their error and time are measured.

Run `odeform simulate object-throw --out THROWS` for the data, and so on; then
`python -m odeform_figures.studies.loads fit THROWS --checkpoint FILE`, which writes what it fits into the checkpoint,
`python -m odeform_figures.studies.loads measure THROWS --out FILE.json`, and `measure DROPS KICKS --split all`: nothing
is fitted to these. `time` compares how long motions with obstacles take with throws.
"""

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from odeform.checkpoint import read_checkpoint, write_checkpoint
from odeform.dataset.index import Dataset
from odeform.dataset.store import open_dataset
from odeform.geometry.rigid import best_rigid, vector_from_rotation
from odeform.loads.registry import load_of_scene
from odeform.models.modal.model import ModalModel
from odeform.models.modal.training.impact_fit import FRAMES, Impact, impact_fit, impacts_of, predicted
from odeform.models.per_object import PerObject
from odeform.models.registry import load, load_model
from odeform.schema import OBJECT
from odeform.simulation.scenes.registry import get_scene
from odeform.types import Floats, Frames
from odeform_figures.output import write_or_print

__all__ = ["fit", "measured", "timed"]

TIMED = ("throw", "wall", "step", "slope")
RIGID = 1e6  # times its stiffness: a body that does not deform


def _part(predictor: Any, name: str) -> ModalModel:
    assert isinstance(predictor, PerObject)
    found = predictor.parts[name]
    assert isinstance(found, ModalModel)
    return found


def _impacts(dataset: Dataset, name: str, splits: Sequence[str]) -> list[Impact]:
    found = [s for split in splits for s in dataset.sequences(split) if s.parameters[OBJECT] == name]
    acting = load_of_scene(dataset.schema.scene)
    assert acting is not None
    return impacts_of(found, dataset.schema.window.rate, acting)


def fit(data: str, checkpoint: str) -> None:
    """Fits each object to the training and validation motions of a data set, and writes that into a checkpoint."""
    dataset, known = open_dataset(data), read_checkpoint(checkpoint)
    found = load_of_scene(dataset.schema.scene)
    assert found is not None
    config = {**known.config, "objects": dict(known.config["objects"])}
    for name in config["objects"]:
        without = {key: value for key, value in config["objects"][name].items() if key != "impact"}
        config["objects"][name] = without
        predictor = load_model(replace(known, config=config)).under(found.name)
        begin, impacts = time.perf_counter(), _impacts(dataset, name, ("train", "val"))
        parameters = impact_fit(_part(predictor, name), impacts)
        config["objects"][name] = {**without, "impact": parameters.to_json()}
        print(f"{name}: {len(impacts)} motions, {time.perf_counter() - begin:.0f} s, {parameters}", flush=True)
    write_checkpoint(checkpoint, replace(known, config=config))


def measured(data: str, checkpoint: str, split: str = "test") -> dict[str, Any]:
    """Errors of each object on the motions of a data set, relative to the displacement since the first contact."""
    dataset = open_dataset(data)
    found = load_of_scene(dataset.schema.scene)
    assert found is not None
    predictor = load(checkpoint).under(found.name)
    out = {}
    for name in dataset.schema.objects:
        if impacts := _impacts(dataset, name, ("train", "val", "test") if split == "all" else (split,)):
            out[name] = _errors(_part(predictor, name), impacts)
    return out


def _errors(model: ModalModel, impacts: Sequence[Impact]) -> dict[str, Any]:
    evaluated = model.evaluate_basis(model.rest, 0.0)
    stiff = replace(model.contact_parameters, stiffness=RIGID)
    models = {"model": model, "rigid": model.with_contact_parameters(stiff)}
    rows: dict[str, Any] = {"motions": len(impacts)}
    for key, one in models.items():
        each = [_relative(one, impact, predicted(one, impact, evaluated, len(impact.times))) for impact in impacts]
        rows[key] = {k: round(float(np.mean([row[k] for row in each])), 4) for k in each[0]}
        for name in ("inside_mm", "cut_mm", "cut_truth_mm"):
            rows[key][name] = round(max(row[name] for row in each), 1)
        rows[key]["median_whole"] = round(float(np.median([row["whole"] for row in each])), 4)
    begin = time.perf_counter()
    for impact in impacts:
        model.solve(parameters=impact.parameters).vertices(0.3)
    rows["ms"] = round(1e3 * (time.perf_counter() - begin) / len(impacts), 1)
    return rows


def _relative(model: ModalModel, impact: Impact, points: Frames) -> dict[str, float]:
    truth = impact.vertices[impact.first :]
    square = ((points - truth) ** 2).sum(axis=2) @ impact.weights
    moved = ((truth - truth[0]) ** 2).sum(axis=2) @ impact.weights
    soon = slice(0, FRAMES + 1)
    turn, shift = best_rigid(truth[-1], points[-1], impact.weights)
    return {
        "first_120_ms": float(np.sqrt(square[soon].mean() / moved[soon].mean())),
        "whole": float(np.sqrt(square.mean() / moved.mean())),
        "place_mm": 1e3 * float(np.linalg.norm(shift)),
        "turn_deg": float(np.degrees(np.linalg.norm(_vector(turn)))),
        "inside_mm": 1e3 * _inside(model, impact, points),
        "cut_mm": 1e3 * _inside(model, impact, _on_faces(model, points)),
        "cut_truth_mm": 1e3 * _inside(model, impact, _on_faces(model, truth)),
    }


def _on_faces(model: ModalModel, points: Frames) -> Frames:
    """The middles of the sides of faces: the edge of an obstacle may cut a face of which all vertices are outside."""
    corners = points[:, model.rest.faces]
    return (0.5 * (corners + np.roll(corners, 1, axis=2))).reshape(len(points), -1, 3)


def _inside(model: ModalModel, impact: Impact, points: Frames) -> float:
    """m by which points (T, N, 3) m are below the floor or inside an obstacle, at most."""
    assert model.load is not None
    gaps = [points[..., 2], *(one.met(points)[0] for one in model.load.obstacles(impact.parameters))]
    return max(-float(np.min(gaps)), 0.0)


def _vector(turn: Floats) -> Floats:
    return vector_from_rotation(turn[None])[0]


def timed(checkpoint: str, objects: Sequence[str], draws: int) -> dict[str, Any]:
    """How long a new motion under each load takes with a frame at its end, in medians over draws of its data, relative
    to that of a throw; one load after the other for each draw, so that all see the same machine."""
    predictor, taken = load(checkpoint), {name: [] for name in TIMED}
    models = {name: predictor.under(name) for name in TIMED}
    for name, model in models.items():
        for parameters in get_scene(f"object-{name}").sample(1, 1, objects):
            model.solve(parameters=parameters).vertices(0.8)  # compiles, and computes what is kept
    for index in range(draws):
        for item in objects:
            for name in TIMED:
                parameters = get_scene(f"object-{name}").sample(draws, 2, [item])[index]
                begin = time.perf_counter()
                models[name].solve(parameters=parameters).vertices(0.8)
                taken[name].append(time.perf_counter() - begin)
    medians = {name: float(np.median(times)) for name, times in taken.items()}
    return {
        name: {"ms": round(1e3 * value, 1), "of_a_throw": round(value / medians["throw"], 2)}
        for name, value in medians.items()
    }


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("fit")
    one.add_argument("data")
    one.add_argument("--checkpoint", required=True)
    other = commands.add_parser("measure")
    other.add_argument("data", nargs="+")
    other.add_argument("--checkpoint", default="contact-force")
    other.add_argument("--split", default="test", choices=("test", "all"))
    other.add_argument("--out")
    third = commands.add_parser("time")
    third.add_argument("--checkpoint", default="contact-force")
    third.add_argument("--object", nargs="+", default=["donut", "pillow", "dog"])
    third.add_argument("--draws", type=int, default=8)
    third.add_argument("--out")
    args = parser.parse_args()
    if args.command == "fit":
        fit(args.data, args.checkpoint)
    elif args.command == "time":
        write_or_print(timed(args.checkpoint, args.object, args.draws), args.out)
    else:
        write_or_print({Path(d).name: measured(d, args.checkpoint, args.split) for d in args.data}, args.out)


if __name__ == "__main__":
    main()
