"""How far motions beyond the trained window are right: compared with simulations of several windows.

Run `python -m odeform_figures.studies.later CKPT ...`; the checkpoints are of one scene.
"""

import argparse
import io
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from odeform.dataset.index import Dataset, Entry
from odeform.dataset.store import open_dataset
from odeform.errors import InputError
from odeform.io import atomic_write
from odeform.models.base import Predictor
from odeform.models.registry import load
from odeform.parallel import parallel_map
from odeform.simulation.physics import GRAVITY
from odeform.simulation.scenes.registry import get_scene
from odeform.types import Faces, Floats, Frames, Mesh
from odeform_figures.output import write_or_print

__all__ = ["RESTS", "Later", "compare_later", "simulate_later"]

SPANS = ((0.0, 1.0), (1.0, 1.5), (1.0, 2.0), (2.0, 4.0))
"""Parts of a motion that are scored, in trained windows."""
WINDOWS = SPANS[-1][1]
RESTS = "rest_speed_m_s"  # of the fixed values of scenes whose motions are simulated until the body lies still
SPEED = 0.05  # s at the end, over which the speed is measured
COUNT = 16
SUMMARY = ("highest_mm", "speed_at_the_end_mm_s", "energy_at_the_end_mJ_kg")
"""Figures of what is left of a motion: how high it still gets, and at the end the speed along the floor and the
energy of its centre, without those of spin and deformation."""


@dataclass(frozen=True, eq=False)
class Later:
    """Motions of a scene over `WINDOWS` trained windows, at its frame rate."""

    entries: list[Entry]
    times: Floats
    """(T,) s."""
    vertices: list[Frames]
    """(T, N, 3) m of each entry."""
    faces: Faces


def simulate_later(dataset: Dataset, count: int = COUNT, keep: Path | None = None) -> Later:
    """`count` test sequences, evenly chosen. Where the data end because the body lies still, it stays so; other motions
    are simulated again, which takes a while, and are kept in the folder `keep`."""
    entries = dataset.select("test")
    entries = entries[:: max(len(entries) // count, 1)][:count]
    window = dataset.schema.window
    until = window.start + WINDOWS * (window.stop - window.start)
    first = dataset.read(entries[0])
    if RESTS in dataset.fixed:
        vertices = [dataset.read(entry).frames(until, window.rate).vertices for entry in entries]
    else:
        vertices = parallel_map("simulations", partial(_simulated, dataset.schema.scene, until, keep), entries)
    times = window.start + np.arange(len(vertices[0])) / window.rate
    return Later(list(entries), times, vertices, first.faces)


def _simulated(scene: str, until: float, keep: Path | None, entry: Entry) -> Frames:
    file = None if keep is None else keep / f"{entry.name}_{until:g}s.npy"
    if file is not None and file.exists():
        return np.load(file)
    vertices = get_scene(scene).simulate(entry.parameters, until=until).vertices
    if file is not None:
        file.parent.mkdir(parents=True, exist_ok=True)
        np.save(buffer := io.BytesIO(), vertices)
        atomic_write(file, buffer.getvalue())
    return vertices


def compare_later(model: Predictor, later: Later) -> dict[str, Any]:
    """Returns, by span, errors in mm, and which fraction of the frames the 90 % band covers, if the model has one. And
    the median difference of each figure of `SUMMARY`, predicted and simulated."""
    window, errors, bands, ends = model.schema.window, [], [], []
    for entry, truth in zip(later.entries, later.vertices, strict=True):
        motion = model.solve(Mesh(truth[0], later.faces), entry.parameters)
        predicted = motion.vertices(later.times)
        errors.append(1e3 * np.sqrt(((predicted - truth) ** 2).sum(axis=2).mean(axis=1) / 3.0))
        band = motion.error_band(later.times)
        bands.append(np.full(len(later.times), np.nan) if band is None else band[:, 1])
        after = later.times > window.stop
        ends.append([_summary(one[after].mean(axis=1), window.rate) for one in (predicted, truth)])
    rmse, band_90, known = np.array(errors), np.array(bands), np.isfinite(bands).all()
    windows = (later.times - window.start) / (window.stop - window.start)
    spans = {}
    for begin, end in SPANS:
        inside = (windows > begin + 1e-9) & (windows <= end + 1e-9)
        of_motions = np.sqrt(np.square(rmse[:, inside]).mean(axis=1))
        spans[f"{begin:g}:{end:g}"] = {
            "pooled_mm": float(np.sqrt(np.square(of_motions).mean())),
            "median_mm": float(np.median(of_motions)),
            "largest_mm": float(of_motions.max()),
            "coverage_90": float((rmse[:, inside] <= band_90[:, inside]).mean()) if known else None,
        }
    difference = np.abs(np.diff(np.array(ends), axis=1)[:, 0])
    differences = {name: float(np.median(column)) for name, column in zip(SUMMARY, difference.T, strict=True)}
    return {"motions": len(errors), "windows": spans, "median_difference": differences}


def _summary(centre: Float[np.ndarray, "times 3"], rate: float) -> list[float]:
    """The figures of `SUMMARY`, speed and energy as means over `SPEED` seconds."""
    frames = max(round(SPEED * rate), 1)
    velocity = (centre[-1] - centre[-1 - frames]) * rate / frames
    energy = 0.5 * velocity @ velocity + GRAVITY * centre[-1 - frames :, 2].mean()
    return [1e3 * float(centre[:, 2].max()), 1e3 * float(np.linalg.norm(velocity[:2])), 1e3 * float(energy)]


def main(argv: list[str] | None = None) -> None:
    """Compare checkpoints over several windows, and print the result or write it to a file."""
    parser = argparse.ArgumentParser("python -m odeform_figures.studies.later", description=__doc__)
    parser.add_argument("checkpoints", nargs="+", metavar="CKPT", help="paths or bundled names, all of one scene")
    parser.add_argument("--data", metavar="DATA", help="data set with the test sequences (default: the scene's)")
    parser.add_argument("--count", type=int, default=COUNT, metavar="N", help=f"test sequences (default: {COUNT})")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="folder of the simulations; those in it are used")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the result to this file")
    args = parser.parse_args(argv)
    if args.count < 1:
        parser.error(f"--count: expected at least 1, got {args.count}")
    try:
        models = {name: load(name) for name in args.checkpoints}
    except InputError as error:
        parser.error(str(error))
    scenes = {model.schema.scene for model in models.values()}
    if len(scenes) > 1 or next(iter(models.values())).schema.objects:
        parser.error(f"expected checkpoints of one scene of one body, got those of {', '.join(sorted(scenes))}")
    scene = scenes.pop()
    try:
        dataset = open_dataset(args.data or scene)
    except InputError as error:
        parser.error(str(error))
    if dataset.schema.scene != scene:
        parser.error(f"--data: expected a data set of scene {scene}, got one of {dataset.schema.scene}")
    later = simulate_later(dataset, args.count, args.keep)
    data = f" --data {args.data}" if args.data else ""
    command = f"python -m odeform_figures.studies.later {' '.join(args.checkpoints)}{data} --count {args.count}"
    found = {"command": command, "models": {name: compare_later(model, later) for name, model in models.items()}}
    write_or_print(found, args.json)


if __name__ == "__main__":
    main()
