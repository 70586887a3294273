"""Many motions of one scene: in parallel, resumable, with the same data for any number of workers."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from odeform.dataset.folder import INDEX, folder_reader, open_folder, save_sequence, write_index
from odeform.dataset.index import Dataset, Entry, assign_splits
from odeform.errors import InputError
from odeform.parallel import as_completed
from odeform.progress import Progress
from odeform.simulation.errors import SimulationError
from odeform.simulation.scene import Scene
from odeform.simulation.scenes.registry import get_scene
from odeform.types import MotionSequence

__all__ = ["simulate"]


TEST_RATE = 4  # factor on the frame rate of test sequences, to score between the trained frames
TIME_SLACK, WEIGHT_SLACK = 1e-3, 1e-4  # of a frame; of the sum of float32 weights


def _one(entry: Entry, simulate: Callable[..., MotionSequence], root: Path, rate: float, step: float) -> Entry:
    try:
        rate = rate * (TEST_RATE if entry.split == "test" else 1)
        sequence = simulate(entry.parameters, rate=rate, step=step)
    except SimulationError as error:
        return replace(entry, status=str(error))
    fault = next(_faults(sequence, rate), None)
    return replace(entry, status=fault) if fault else replace(entry, sha256=save_sequence(root, entry.name, sequence))


def _faults(sequence: MotionSequence, rate: float) -> Iterator[str]:
    """What is wrong with a sequence simulated at `rate` Hz. Each check assumes that those before it passed."""
    times, vertices, faces, weights = sequence.times, sequence.vertices, sequence.faces, sequence.weights
    if times.ndim != 1 or len(times) < 2:
        yield f"times: expected (T,) with at least 2 frames, got shape {times.shape}"
    elif not np.allclose(times, np.arange(len(times)) / rate, rtol=0.0, atol=TIME_SLACK / rate):
        yield f"times: expected 0, 1, 2, ... / {rate:g} Hz, got {times[0]:g}, {times[1]:g}, ..., {times[-1]:g} s"
    if vertices.ndim != 3 or len(vertices) != len(times) or vertices.shape[2] != 3:
        yield f"vertices: expected shape (T, N, 3) with {len(times)} frames, got {vertices.shape}"
    if not (finite := np.isfinite(vertices)).all():
        yield f"vertices: not finite in {(~finite).any(axis=(1, 2)).sum()} of {len(times)} frames"
    count = vertices.shape[1]
    if faces.ndim != 2 or faces.shape[1] != 3 or not np.issubdtype(faces.dtype, np.integer):
        yield f"faces: expected integers of shape (F, 3), got {faces.dtype} of shape {faces.shape}"
    if faces.size and not 0 <= faces.min() <= faces.max() < count:
        yield f"faces: expected indices of {count} vertices, got {faces.min()} to {faces.max()}"
    if weights.shape != (count,):
        yield f"weights: expected shape ({count},), one per vertex, got {weights.shape}"
    if not (weights >= 0.0).all() or abs(weights.sum() - 1.0) > WEIGHT_SLACK:
        yield f"weights: expected no negative ones and a sum of 1, got {weights.min():g} or more, sum {weights.sum():g}"


def _finished(root: Path, plan: list[Entry], new: Dataset) -> dict[str, Entry]:
    """Entries that an earlier, interrupted run of the same plan has completed."""
    if not (root / INDEX).exists():
        return {}
    old = open_folder(root)
    for part in ("provenance", "fixed", "schema"):
        was, expected = getattr(old, part), getattr(new, part)
        if was != expected:
            raise InputError(
                f"{root}: holds another data set, with {part} {was}; expected {expected} or an empty folder"
            )
    expected = {entry.name: entry for entry in plan}
    return {e.name: e for e in old.entries if e.name in expected and e.parameters == expected[e.name].parameters}


def simulate(
    scene: str,
    out: str | Path,
    count: int | None = None,
    seed: int = 0,
    workers: int = 1,
    rate: float | None = None,
    step: float | None = None,
    corners: bool = False,
) -> Dataset:
    """Simulate `count` sequences of a scene into the folder `out`; an interrupted run is continued.

    Args:
        scene: Name of a scene, for example "kick".
        out: Folder to write to: empty, or with an unfinished data set of the same arguments.
        count: Number of sequences; default: that of the scene's own data set.
        seed: Seeds the parameters that are drawn and the splits.
        workers: Number of processes. The data do not depend on it.
        rate: Frames per second, in Hz; default: the scene's. Test sequences have four times as many.
        step: Time step of the simulator in seconds; default: the scene's.
        corners: Also simulate the corners of the parameter box, for the training split.

    Returns:
        The data set. Failed sequences stay in its index, with the reason as their status.

    Raises:
        InputError: An unknown scene, a number out of range, or a folder with another data set.

    Examples:
        >>> import odeform
        >>> dataset = odeform.simulate("kick", "kicks", count=1, rate=30.0, step=4e-3)
        >>> next(dataset.sequences("all")).vertices.shape
        (31, 402, 3)
    """
    known = get_scene(scene)
    count = known.count if count is None else count
    if count < 1 or workers < 1 or seed < 0 or not (rate is None or 0.0 < rate < math.inf):
        raise InputError("simulate: expected count and workers of at least 1, seed of at least 0, and a positive rate")
    root, rate, step = Path(out), rate or known.schema.window.rate, step or known.step
    plan = _plan(scene, known, count, seed, corners)
    schema = replace(known.schema, window=replace(known.schema.window, rate=rate))
    provenance = {"scene": scene, "count": count, "seed": seed, "rate_hz": rate, "step_s": step}
    provenance |= {"corners": True} if corners else {}
    empty = Dataset(root, schema, (), folder_reader(root), known.fixed, provenance)
    done = _finished(root, plan, empty)
    progress = Progress(f"simulate {scene}", len(plan), done=len(done))

    def index() -> Dataset:
        dataset = replace(empty, entries=tuple(done[e.name] for e in plan if e.name in done))
        write_index(dataset)
        return dataset

    root.mkdir(parents=True, exist_ok=True)
    work = partial(_one, simulate=known.simulate, root=root, rate=rate, step=step)
    for _, entry in as_completed(work, [entry for entry in plan if entry.name not in done], workers):
        done[entry.name] = entry
        index()
        progress.advance(note="" if entry.status == "ok" else f"{entry.name} failed: {entry.status}")
    progress.close()
    return index()


def _plan(name: str, scene: Scene, count: int, seed: int, corners: bool) -> list[Entry]:
    drawn = zip(scene.sample(count, seed), assign_splits(count, seed), strict=True)
    plan = [Entry(f"{name}_{index:05d}", split, parameters) for index, (parameters, split) in enumerate(drawn)]
    if corners:
        # in more than two dimensions hardly any drawn point is near a corner, but sliders reach them
        plan += [Entry(f"{name}_corner_{i:02d}", "train", at) for i, at in enumerate(scene.schema.corners())]
    return plan
