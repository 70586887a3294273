"""How right motions outside of the trained ranges are: compared with simulations at their sides and corners.

Run `python -m odeform_figures.studies.outside CKPT`. With `--fit FILE` it writes the checkpoint with a band that widens
there as the errors of other simulations do. The shipped figures are in `assets/studies`.
"""

import argparse
import io
import itertools
import os
from dataclasses import replace
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from odeform.checkpoint import write_checkpoint
from odeform.errors import InputError
from odeform.io import atomic_write
from odeform.models.base import Predictor
from odeform.models.conformal import motion_score
from odeform.models.error_band import OUTSIDE, STRONGER
from odeform.models.registry import load
from odeform.models.training.outside import growth_of_stronger, growth_outside
from odeform.parallel import parallel_map
from odeform.schema import OBJECT, Parameter, Parameters, Schema
from odeform.simulation.contacts import weaker
from odeform.simulation.objects.catalog import get_object
from odeform.simulation.scenes.contact_force import drawn_on, simulate_object
from odeform.simulation.scenes.registry import get_scene
from odeform.types import Floats, Frames, PointCloud
from odeform_figures.output import write_or_print

__all__ = ["Outside", "compared", "fitted", "outside", "summary"]

FRACTIONS = (0.1, 0.25)
"""How far outside: of the end of a range, or of the range where that end is zero."""
FIT, TEST = 11, 23
"""Seeds of the motions that a band is fitted to, and of those that say how right it is."""
PUSHES = 3
SCATTER = (0.7, 1.3)  # times these fractions, for corners of the first


class Outside(NamedTuple):
    """A motion outside of the trained ranges."""

    name: str
    parameters: Parameters
    errors: Floats
    """(T,) mm at the frames after the first."""
    band: Floats
    """(T, 2) mm."""


def outside(schema: Schema, fraction: float, seed: int) -> list[tuple[str, dict[str, Any]]]:
    """Names and parameters: one beyond each end of each range, the others inside; then all beyond, at each corner. Of
    bodies that are pushed, `PUSHES` of each, by more than the strongest force."""
    if schema.objects:
        return [row for name in schema.objects for row in _pushes(name, fraction, seed)]
    rng, rows = np.random.default_rng(seed + round(100 * fraction)), []

    def inside() -> dict[str, float]:
        return {p.name: p.denormalise(rng.uniform(-1.0, 1.0)) for p in schema.parameters}

    for p in schema.learned:
        for side in (-1, 1):
            rows.append((f"{p.name} {'-+'[side > 0]}", {**inside(), p.name: _beyond(p, side, fraction)}))
    for sides in itertools.product((-1, 1), repeat=len(schema.learned)):
        row = inside()
        for p, side in zip(schema.learned, sides, strict=True):
            row[p.name] = _beyond(p, side, fraction * (1.0 if seed == TEST else rng.uniform(*SCATTER)))
        rows.append((f"corner {''.join('-+'[side > 0] for side in sides)}", row))
    return rows


def _pushes(name: str, fraction: float, seed: int) -> list[tuple[str, dict[str, Any]]]:
    item = get_object(name)
    force = (1.0 + fraction) * item.forces[1]
    drawn = drawn_on(item, (force, force), PUSHES, seed)
    return [(f"{name} {index}", {OBJECT: name, **one}) for index, one in enumerate(drawn)]


def _beyond(p: Parameter, side: int, fraction: float) -> float:
    end = p.low if side < 0 else p.high
    return end + side * fraction * (abs(end) if end else p.high - p.low)


def _simulated(scene: str, keep: Path | None, job: tuple[str, dict[str, Any]]) -> Frames:
    name, parameters = job
    file = None if keep is None else keep / f"{name}.npy"
    if file is not None and file.exists():
        return np.load(file)
    known = get_scene(scene)
    simulate = known.simulate
    if (
        OBJECT in parameters
    ):  # guarded, as those that one asks for on the page: strong pushes turn tetrahedra inside out
        simulate = partial(simulate_object, get_object(parameters[OBJECT]))
    vertices = simulate(parameters, rate=known.schema.window.rate, step=known.step).vertices.astype(np.float32)
    if file is not None:
        file.parent.mkdir(parents=True, exist_ok=True)
        np.save(buffer := io.BytesIO(), vertices)
        atomic_write(file, buffer.getvalue())
    return vertices


def compared(model: Predictor, seed: int, workers: int, keep: Path | None = None) -> dict[float, list[Outside]]:
    """The motions of each of `FRACTIONS`, whose simulations are kept in the folder `keep`."""
    scene, times, found = model.schema.scene, model.schema.window.times, {}
    for fraction in FRACTIONS:
        jobs = [(f"{scene}-{seed}-{fraction:g}-{name}", row) for name, row in outside(model.schema, fraction, seed)]
        truths = parallel_map(f"outside {fraction:g}", partial(_simulated, scene, keep), jobs, workers)
        found[fraction] = [_compared(model, times, *job, truth) for job, truth in zip(jobs, truths, strict=True)]
    return found


def _compared(model: Predictor, times: Floats, name: str, parameters: Parameters, truth: Frames) -> Outside:
    motion = model.solve(PointCloud(truth[0]), parameters)
    truth = truth[np.minimum(np.arange(len(times)), len(truth) - 1)]  # simulations end when the body lies still
    errors = 1e3 * np.sqrt(np.square(motion.vertices(times) - truth).mean(axis=(1, 2)))
    band = motion.error_band(times)
    if band is None:
        raise InputError(f"{model.model}: expected a model with an error band")
    return Outside(name, parameters, errors[1:], band[1:])


def summary(motions: list[Outside]) -> dict[str, Any]:
    """Pooled errors in mm of all motions, of those at sides and at corners, and what of them the 90 % band covers."""
    corners = [motion for motion in motions if "corner" in motion.name]
    sides = [motion for motion in motions if "corner" not in motion.name]
    pooled = {name: _rms([each.errors for each in some]) for name, some in (("sides", sides), ("corners", corners))}
    covered = [_rms([each.errors]) <= _rms([each.band[:, 1]]) for each in motions]
    return {
        "pooled_mm": _rms([each.errors for each in motions]),
        **{f"{name}_mm": value for name, value in pooled.items()},
        "covered_motions": float(np.mean(covered)),
        "covered_frames": float(np.mean([each.errors <= each.band[:, 1] for each in motions])),
        "motions": {
            each.name: {"rmse_mm": _rms([each.errors]), "band_mm": _rms([each.band[:, 1]])} for each in motions
        },
    }


def _rms(values: list[Floats]) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values else 0.0


def fitted(model: Predictor, motions: list[Outside]) -> Predictor:
    """The model with a band that widens as the errors of these motions do: of pushed bodies, all alike."""
    if model.schema.objects:
        stronger = np.array([model.stronger(each.parameters) for each in motions])
        bands = [
            _of_nearest(model, weaker(each.parameters, 1.0 + 0.5 * by))
            for each, by in zip(motions, stronger, strict=True)
        ]
        scores = [motion_score(each.errors, band[:, 1]) for each, band in zip(motions, bands, strict=True)]
        growth = growth_of_stronger(stronger, np.array(scores))
        added = {f"{name}/{STRONGER}": growth for name in model.schema.objects}
    else:
        theta = np.stack([model.schema.vector(model.schema.complete(each.parameters)) for each in motions])
        bands = np.stack([_of_nearest(model, each.parameters) for each in motions])
        added = {OUTSIDE: growth_outside(theta, np.stack([each.errors for each in motions]), bands)}
    return model.of_same_kind(replace(model.checkpoint, arrays={**model.checkpoint.arrays, **added}))


def _of_nearest(model: Predictor, parameters: Parameters) -> Floats:
    """(T, 2) mm: the band of the nearest parameters in the trained ranges, after the first frame."""
    schema = model.schema
    complete = model.complete(parameters)
    ends = zip(schema.learned, np.clip(schema.vector(complete), -1.0, 1.0), strict=True)
    band = model.error_band({**complete, **{p.name: p.denormalise(float(u)) for p, u in ends}}, schema.window.times)
    if band is None:
        raise InputError(f"{model.model}: expected a model with an error band")
    return band[1:]


def main() -> None:
    """Run the comparison from the command line."""
    parser = argparse.ArgumentParser(prog="python -m odeform_figures.studies.outside", description=__doc__)
    cores = os.cpu_count() or 1
    parser.add_argument("checkpoint", metavar="CKPT", help="a checkpoint")
    parser.add_argument("--workers", type=int, default=cores, metavar="W", help=f"processes (default: {cores})")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="folder of simulations, which take minutes")
    parser.add_argument("--fit", type=Path, metavar="FILE", help="fit the band first, and write the checkpoint")
    parser.add_argument("--json", metavar="FILE", help="write the result to this file instead of printing it")
    args = parser.parse_args()
    command = f"python -m odeform_figures.studies.outside {args.checkpoint}"
    try:
        model = load(args.checkpoint)
        if args.fit is not None:
            found = compared(model, FIT, args.workers, args.keep)
            model = fitted(model, [motion for motions in found.values() for motion in motions])
            how = {"outside": {"command": f"{command} --fit FILE", "versions": {"odeform": version("odeform")}}}
            known = {**model.checkpoint.provenance, **how}
            write_checkpoint(args.fit, replace(model.checkpoint, provenance=known))
        test = compared(model, TEST, args.workers, args.keep)
    except InputError as error:
        parser.error(str(error))
    write_or_print(
        {"command": command, **{f"{fraction:g}": summary(motions) for fraction, motions in test.items()}}, args.json
    )


if __name__ == "__main__":
    main()
