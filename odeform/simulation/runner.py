"""Many motions of one scene: in parallel, resumable, with the same data for any number of workers."""

import math
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from odeform.dataset.folder import encode_sequence, folder_reader, save_encoded, write_index
from odeform.dataset.index import Dataset, Entry
from odeform.errors import InputError, one_line
from odeform.parallel import as_completed
from odeform.progress import Progress
from odeform.schema import OBJECT
from odeform.simulation.errors import SimulationError
from odeform.simulation.plan import counts, finished, plan
from odeform.simulation.scene import Scene
from odeform.simulation.scenes.registry import get_scene
from odeform.types import MotionSequence

__all__ = ["UNEXPECTED", "simulate"]


UNEXPECTED = "unexpected"
"""Start of the status of a sequence that failed with anything but a `SimulationError`. The next run tries it again."""
TEST_RATE = 4  # factor on the frame rate of test sequences, to score between the trained frames
WRITING = 0.02  # fraction of the time that goes into writing the index
TIME_SLACK, WEIGHT_SLACK = 1e-3, 1e-4  # of a frame; of the sum of float32 weights


def _one(entry: Entry, simulate: Callable[..., MotionSequence], rate: float, step: float) -> bytes | str:
    """The encoded sequence, or the reason why there is none. Workers need not see the folder of the data set."""
    try:
        rate = rate * (TEST_RATE if entry.split == "test" else 1)
        sequence = simulate(entry.parameters, rate=rate, step=step)
        return next(_faults(sequence, rate), None) or encode_sequence(sequence)
    except SimulationError as error:
        return str(error)
    except Exception as error:  # of one sequence; the others go on
        place = traceback.extract_tb(error.__traceback__)[-1]
        return one_line(f"{UNEXPECTED} {type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno})")


def _faults(sequence: MotionSequence, rate: float) -> Iterator[str]:
    """Says what is wrong with a sequence simulated at `rate` Hz. Each check assumes that those before it passed."""
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


class _Index:
    """The index of a folder while its sequences are simulated: `done` by name, in the order of the schema's objects."""

    def __init__(self, empty: Dataset, entries: Sequence[Entry], old: Dataset | None) -> None:
        kept = [entry for entry in old.entries if not entry.status.startswith(UNEXPECTED)] if old is not None else []
        self.done = {entry.name: entry for entry in kept}
        order = dict.fromkeys([*(entry.name for entry in entries), *self.done])
        self._order = {name: place for place, name in enumerate(order)}
        count = empty.provenance["count"]
        if old is not None and isinstance(count, dict):
            count = {**old.provenance["count"], **count}
        self._empty = replace(empty, provenance={**empty.provenance, "count": count})
        self._next = 0.0

    def add(self, entry: Entry) -> None:
        """Add a finished sequence. The file is written again at most a fraction of the time: with thousands of entries
        this takes as long as a part of a simulation."""
        self.done[entry.name] = entry
        if (begin := time.monotonic()) >= self._next:
            self.write()
            self._next = time.monotonic() + (time.monotonic() - begin) / WRITING

    def write(self) -> Dataset:
        """Write the file; returns what it holds."""
        objects = self._empty.schema.objects

        def place(entry: Entry) -> tuple[int, int]:
            return objects.index(entry.parameters[OBJECT]) if objects else 0, self._order[entry.name]

        dataset = replace(self._empty, entries=tuple(sorted(self.done.values(), key=place)))
        write_index(dataset)
        return dataset


def simulate(
    scene: str | Scene,
    out: str | Path,
    count: int | None = None,
    seed: int = 0,
    workers: int = 1,
    rate: float | None = None,
    step: float | None = None,
    corners: bool = False,
    objects: Sequence[str] = (),
    ranges: Mapping[str, tuple[float, float]] | None = None,
    made_of: Mapping[str, Any] | None = None,
    report: Callable[[int, int], None] = lambda done, count: None,
) -> Dataset:
    """Simulate `count` sequences of a scene into the folder `out`; an interrupted run is continued.

    A finished data set is extended by a larger count, and by further objects: its sequences are kept. A scene without
    objects splits its data at random; beyond the scene's own count, further sequences are for training.

    Args:
        scene: Name of a scene, for example "kick", or a scene.
        out: Folder to write to: empty, or with a data set of the same arguments that is unfinished or shorter.
        count: Number of sequences, for each object of a scene with several; default: that of the scene's own data set.
        seed: Seeds the parameters that are drawn and the splits.
        workers: Number of processes. The data do not depend on it.
        rate: Frames per second, in Hz; default: the scene's. Test sequences have four times as many.
        step: Time step of the simulator in seconds; default: the scene's.
        corners: Also simulate the corners of the parameter box, for the training split.
        objects: Names of the objects to simulate in a scene with several; default: all. The data of one object do not
            depend on which others are simulated.
        ranges: Low and high of parameters by name, in their units, in place of the scene's.
        made_of: Says in the provenance what the bodies of a scene of one's own were made of.
        report: Called with the number of sequences that are done, and of all, at the start and after each.

    Returns:
        The data set. Failed sequences stay in its index, with the reason as their status. Those that failed with
        another exception than `SimulationError` are tried again by the next run.

    Raises:
        InputError: An unknown scene, object or parameter, a number out of range, or a folder with another data set.

    Examples:
        >>> import odeform
        >>> dataset = odeform.simulate("kick", "kicks", count=1, rate=30.0, step=4e-3)
        >>> next(dataset.sequences("all")).vertices.shape
        (31, 402, 3)
    """
    known, ranges = get_scene(scene) if isinstance(scene, str) else scene, dict(ranges or {})
    known = replace(known, schema=known.schema.with_ranges(ranges))
    count = known.count if count is None else count
    if count < 1 or workers < 1 or seed < 0 or not (rate is None or 0.0 < rate < math.inf):
        raise InputError("simulate: expected count and workers of at least 1, seed of at least 0, and a positive rate")
    root, rate, step = Path(out), rate or known.schema.window.rate, step or known.step
    entries = plan(known, count, seed, objects, corners)
    window = replace(known.schema.window, rate=rate)
    schema = replace(known.schema, window=window, surroundings=known.surroundings)
    asked = counts(known, count, objects)
    provenance = {"scene": schema.scene, "count": asked, "seed": seed, "rate_hz": rate, "step_s": step}
    provenance |= {"corners": True} if corners else {}
    provenance |= {"ranges": {name: list(ends) for name, ends in ranges.items()}} if ranges else {}
    provenance |= {"made_of": dict(made_of)} if made_of else {}
    empty = Dataset(root, schema, (), folder_reader(root), known.fixed, provenance)
    return _complete(empty, entries, workers, partial(_one, simulate=known.simulate, rate=rate, step=step), report)


def _complete(
    empty: Dataset,
    entries: Sequence[Entry],
    workers: int,
    work: Callable[[Entry], bytes | str],
    report: Callable[[int, int], None],
) -> Dataset:
    """Do the `work` for those of the plan `entries` that the folder of `empty` lacks; returns what it then holds."""
    index = _Index(empty, entries, finished(empty.root, entries, empty))
    left = [entry for entry in entries if entry.name not in index.done]
    progress = Progress(f"simulate {empty.schema.scene}", len(entries), done=len(entries) - len(left))
    done = len(entries) - len(left)
    report(done, len(entries))
    try:
        for place, found in as_completed(work, left, workers):
            if isinstance(found, str):
                entry = replace(left[place], status=found)
            else:
                entry = replace(left[place], sha256=save_encoded(empty.root, left[place].name, found))
            index.add(entry)
            done += 1
            report(done, len(entries))
            progress.advance(note="" if entry.status == "ok" else f"{entry.name} failed: {entry.status}")
    finally:
        progress.close()
        dataset = index.write()
    return dataset
