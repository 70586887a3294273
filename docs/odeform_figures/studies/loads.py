"""Loads of the seven objects: how they meet the floor is fitted, and their error and time are measured.

`odeform simulate object-throw --out THROWS` makes data, and so on. `python -m odeform_figures.studies.loads` then does
the rest. `fit THROWS DROPS --checkpoint FILE` and `choose KICKS --checkpoint FILE` write what they find into a
checkpoint; `measure DROPS KICKS --split all --out FILE.json` measures on others, and `measure DROPS --checkpoint GP`
a baseline that was trained on drops. `time` compares how long motions with obstacles take with throws.
"""

import argparse
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from odeform.benchmark.timing import as_viewed
from odeform.checkpoint import read_checkpoint, write_checkpoint
from odeform.dataset.index import Dataset
from odeform.dataset.store import open_dataset
from odeform.geometry.rigid import best_rigid, vector_from_rotation
from odeform.geometry.solids.overlap import overlap
from odeform.loads.registry import PUSH, load_of_scene
from odeform.models.base import Predictor
from odeform.models.modal.model import ModalModel
from odeform.models.modal.training.impact_fit import FRAMES, Impact, impact_fit, impacts_of, predicted
from odeform.models.per_object import PerObject
from odeform.models.registry import load, load_model
from odeform.schema import OBJECT
from odeform.simulation.scenes.registry import get_scene
from odeform.types import Floats, Frames, Mesh
from odeform_figures.output import write_or_print

__all__ = ["errors_of", "fit", "measured", "relative_errors", "timed"]

TIMED = ("throw", "wall", "step", "slope", "meet")
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


def fit(data: Sequence[str], checkpoint: str, names: Sequence[str] | None = None) -> None:
    """Fits each object to the training and validation motions of data sets in which it flies, and writes that into a
    checkpoint."""
    sets = [open_dataset(one) for one in data]
    for name in names or read_checkpoint(checkpoint).config["objects"]:
        known, begin = read_checkpoint(checkpoint), time.perf_counter()
        part = {key: value for key, value in known.config["objects"][name].items() if key != "impact"}
        plain = replace(known, config=_with_part(known.config, name, part))
        flights = []
        for dataset in sets:
            load = load_of_scene(dataset.schema.scene)
            assert load is not None
            if impacts := _impacts(dataset, name, ("train", "val")):
                flights.append((_part(load_model(plain).under(load.name), name), impacts))
        parameters = impact_fit(flights)
        config = _with_part(known.config, name, {**part, "impact": parameters.to_json()})
        write_checkpoint(checkpoint, replace(known, config=config))
        count = sum(len(impacts) for _, impacts in flights)
        print(f"{name}: {count} motions, {time.perf_counter() - begin:.0f} s, {parameters}", flush=True)


def choose(data: str, checkpoint: str) -> None:
    """Chooses for each object whether a kicked body meets the floor as one that is pushed or as one that falls: the
    latter where it is better on training motions by more than the standard error; writes that into a checkpoint."""
    dataset = open_dataset(data)
    for name in read_checkpoint(checkpoint).config["objects"]:
        known, errors = read_checkpoint(checkpoint), []
        impacts = _impacts(dataset, name, ("train", "val"))
        part = {key: value for key, value in known.config["objects"][name].items() if key != "kicked_as"}
        for option in (part, {**part, "kicked_as": "impact"}):
            trial = load_model(replace(known, config=_with_part(known.config, name, option)))
            model = _part(trial.under("kick"), name)
            evaluated = model.evaluate_basis(model.rest, 0.0)
            found = [relative_errors(one, predicted(model, one, evaluated, len(one.times))) for one in impacts]
            errors.append([row["first_120_ms"] for row in found])
        gain = np.subtract(*errors)
        falls = bool(len(gain) > 1 and gain.mean() > gain.std(ddof=1) / np.sqrt(len(gain)))
        chosen = {**part, "kicked_as": "impact"} if falls else part
        write_checkpoint(checkpoint, replace(known, config=_with_part(known.config, name, chosen)))
        pushed, fallen = np.mean(errors, axis=1)
        print(f"{name}: {len(impacts)} kicks, as pushed {pushed:.3f}, as falling {fallen:.3f}: {falls}", flush=True)


def _with_part(config: Mapping[str, Any], name: str, part: Mapping[str, Any]) -> dict[str, Any]:
    return {**config, "objects": {**config["objects"], name: part}}


def measured(data: str, checkpoint: str, split: str = "test") -> dict[str, Any]:
    """Errors of each object on the motions of a data set, relative to the displacement since the first contact."""
    dataset = open_dataset(data)
    found = load_of_scene(dataset.schema.scene)
    assert found is not None
    predictor = load(checkpoint)
    if predictor.schema.scene == dataset.schema.scene:
        return _rival(predictor, dataset, split)
    predictor, out = predictor.under(found.name), {}
    for name in dataset.schema.objects:
        if impacts := _impacts(dataset, name, ("train", "val", "test") if split == "all" else (split,)):
            out[name] = errors_of(_part(predictor, name), impacts)
    return out


def _rival(predictor: Predictor, dataset: Dataset, split: str) -> dict[str, Any]:
    """Errors of a model that was trained on such motions."""
    out = {}
    for name in predictor.schema.objects:
        impacts = _impacts(dataset, name, ("train", "val", "test") if split == "all" else (split,))
        rows = []
        for impact in impacts:
            motion = predictor.solve(parameters=impact.parameters)
            points = [np.asarray(motion.vertices(float(t)), float) for t in impact.times[impact.first :]]
            rows.append(relative_errors(impact, np.stack(points)))
        if rows:
            means = {key: round(float(np.mean([row[key] for row in rows])), 4) for key in rows[0]}
            out[name] = {"motions": len(rows), "model": means}
    return out


def errors_of(model: ModalModel, impacts: Sequence[Impact]) -> dict[str, Any]:
    """Mean errors of a model, and of a body that does not deform, on impacts: relative to the displacement, in mm and
    degrees; and what a motion takes, in ms."""
    evaluated = model.evaluate_basis(model.rest, 0.0)
    stiff = replace(model.contact_parameters, stiffness=RIGID)
    models = {"model": model, "rigid": model.with_contact_parameters(stiff)}
    rows: dict[str, Any] = {"motions": len(impacts)}
    for key, one in models.items():
        motions = [predicted(one, impact, evaluated, len(impact.times)) for impact in impacts]
        each = [relative_errors(impact, points) for impact, points in zip(impacts, motions, strict=True)]
        rows[key] = {k: round(float(np.mean([row[k] for row in each])), 4) for k in each[0]}
        deep = [_depths(one, impact, points) for impact, points in zip(impacts, motions, strict=True)]
        rows[key].update({k: round(max(row[k] for row in deep), 1) for k in deep[0]})
        rows[key]["median_whole"] = round(float(np.median([row["whole"] for row in each])), 4)
    begin = time.perf_counter()
    for impact in impacts:
        model.solve(parameters=impact.parameters).vertices(0.3)
    rows["ms"] = round(1e3 * (time.perf_counter() - begin) / len(impacts), 1)
    return rows


def relative_errors(impact: Impact, points: Frames) -> dict[str, float]:
    """Errors of points (T, S, 3) m from the first contact of an impact on, relative to the displacement since then, and
    how far place and orientation are off at the end."""
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
    }


def _depths(model: ModalModel, impact: Impact, points: Frames) -> dict[str, float]:
    """How deep vertices and faces are inside what they meet, at most, in mm; and those of the truth."""
    truth = impact.vertices[impact.first :]
    if model.load is not None and model.load.pairs:
        return {
            "inside_mm": 1e3 * _inside(model, impact, points),
            "overlap_mm": 1e3 * _overlap(model, points),
            "overlap_truth_mm": 1e3 * _overlap(model, truth),
        }
    return {
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


def _overlap(model: ModalModel, points: Frames) -> float:
    """m by which the vertices of one body are inside the other one, at most, of points (T, 2 S, 3) m of both."""
    one, other = np.split(points, 2, axis=1)
    faces = model.rest.faces
    return max(overlap(Mesh(a, faces), Mesh(b, faces)) for a, b in zip(one, other, strict=True))


def _vector(turn: Floats) -> Floats:
    return vector_from_rotation(turn[None])[0]


def timed(checkpoint: str, objects: Sequence[str], draws: int, loads: Sequence[str] = TIMED) -> dict[str, Any]:
    """Processor time of a new motion under each load (or push) with a frame at its end, in ms and medians over draws
    of its data; relative to that of a throw, if it is among them. One load after the other for each draw, so that all
    see the same machine. `of_objects` has the median of each object."""
    predictor = load(checkpoint)
    models = {name: predictor if name == PUSH else predictor.under(name) for name in loads}
    taken: dict[str, dict[str, list[float]]] = {name: {item: [] for item in objects} for name in loads}
    with as_viewed():
        for model in models.values():
            for parameters in get_scene(model.schema.scene).sample(1, 1, objects):
                _milliseconds(model, parameters)  # compiles, and computes what is kept
        for index in range(draws):
            for item in objects:
                for name, model in models.items():
                    parameters = get_scene(model.schema.scene).sample(draws, 2, [item])[index]
                    taken[name][item].append(_milliseconds(model, parameters))
    medians = {name: float(np.median([*times.values()])) for name, times in taken.items()}
    return {
        name: {
            "ms": round(value, 1),
            **({"of_a_throw": round(value / medians["throw"], 2)} if "throw" in medians else {}),
            "of_objects": {item: round(float(np.median(times)), 1) for item, times in taken[name].items()},
        }
        for name, value in medians.items()
    }


def _milliseconds(model: Predictor, parameters: Mapping[str, Any]) -> float:
    begin = time.process_time()
    model.solve(parameters=parameters).vertices(model.schema.window.stop)
    return 1e3 * (time.process_time() - begin)


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    one = commands.add_parser("fit")
    one.add_argument("data", nargs="+")
    one.add_argument("--object", nargs="+", help="objects to fit (default: all)")
    one.add_argument("--checkpoint", required=True)
    third = commands.add_parser("choose")
    third.add_argument("data")
    third.add_argument("--checkpoint", required=True)
    other = commands.add_parser("measure")
    other.add_argument("data", nargs="+")
    other.add_argument("--checkpoint", default="contact-force")
    other.add_argument("--split", default="test", choices=("test", "all"))
    other.add_argument("--out")
    timing = commands.add_parser("time")
    timing.add_argument("--checkpoint", default="contact-force")
    timing.add_argument("--object", nargs="+", default=["donut", "pillow", "dog"])
    timing.add_argument("--load", nargs="+", default=TIMED, help=f"loads (default: {' '.join(TIMED)})")
    timing.add_argument("--draws", type=int, default=8)
    timing.add_argument("--out")
    args = parser.parse_args()
    if args.command == "fit":
        fit(args.data, args.checkpoint, args.object)
    elif args.command == "choose":
        choose(args.data, args.checkpoint)
    elif args.command == "time":
        write_or_print(timed(args.checkpoint, args.object, args.draws, args.load), args.out)
    else:
        write_or_print({Path(d).name: measured(d, args.checkpoint, args.split) for d in args.data}, args.out)


if __name__ == "__main__":
    main()
