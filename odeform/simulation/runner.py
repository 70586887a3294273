"""Many motions of one scene: in parallel, resumable, the same data whatever the number of workers."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed

from odeform.dataset.folder import INDEX, folder_reader, open_folder, save_sequence, write_index
from odeform.dataset.index import Dataset, Entry, assign_splits
from odeform.errors import InputError
from odeform.progress import Progress
from odeform.simulation.scene import Scene, get_scene
from odeform.simulation.shell import SimulationError

__all__ = ["simulate_dataset"]


TEST_RATE = 4  # test sequences have so many times the frames: people look between those that were learned


def _one(scene_name: str, entry: Entry, root: Path, rate: float, step: float) -> Entry:
    try:
        rate = rate * (TEST_RATE if entry.split == "test" else 1)
        sequence = get_scene(scene_name).simulate(entry.parameters, rate=rate, step=step)
    except SimulationError as error:
        return replace(entry, status=str(error))
    return replace(entry, sha256=save_sequence(root, entry.name, sequence))


def _finished(root: Path, plan: list[Entry], new: Dataset) -> dict[str, Entry]:
    """Entries that an earlier, interrupted run of the same plan has completed."""
    if not (root / INDEX).exists():
        return {}
    old = open_folder(root)
    for part in ("provenance", "fixed", "schema"):
        was, wanted = getattr(old, part), getattr(new, part)
        if was != wanted:
            raise InputError(f"{root}: holds another data set, of {part} {was}; expected {wanted} or an empty folder")
    wanted = {entry.name: entry for entry in plan}
    return {e.name: e for e in old.entries if e.name in wanted and e.parameters == wanted[e.name].parameters}


def simulate_dataset(
    scene_name: str,
    out: str | Path,
    count: int,
    seed: int = 0,
    workers: int = 1,
    rate: float | None = None,
    step: float | None = None,
    corners: bool = False,
) -> Dataset:
    """Simulate `count` sequences of a scene into the folder `out`; continues where an earlier run stopped.

    `rate` in Hz and `step` in seconds default to the scene's own. With `corners`, those of the trained box besides, for
    training.
    """
    scene: Scene = get_scene(scene_name)
    root = Path(out)
    rate = rate or scene.schema.window.rate
    step = step or scene.step
    schema = replace(scene.schema, window=replace(scene.schema.window, rate=rate))
    provenance = {"scene": scene_name, "count": count, "seed": seed, "rate_hz": rate, "step_s": step}
    provenance |= {"corners": True} if corners else {}
    plan = [
        Entry(f"{scene_name}_{index:05d}", split, parameters)
        for index, (parameters, split) in enumerate(
            zip(scene.sample(count, seed), assign_splits(count, seed), strict=True)
        )
    ]
    if corners:
        # in more than two dimensions hardly any drawn point is near one, and sliders reach them
        plan += [Entry(f"{scene_name}_corner_{i:02d}", "train", at) for i, at in enumerate(scene.schema.corners())]
    empty = Dataset(root, schema, (), folder_reader(root), scene.fixed, provenance)
    done = _finished(root, plan, empty)
    todo = [entry for entry in plan if entry.name not in done]
    progress = Progress(f"simulate {scene_name}", len(plan), done=len(done))

    def index() -> Dataset:
        dataset = replace(empty, entries=tuple(done[e.name] for e in plan if e.name in done))
        write_index(dataset)
        return dataset

    root.mkdir(parents=True, exist_ok=True)
    jobs = (delayed(_one)(scene_name, entry, root, rate, step) for entry in todo)
    finished: Any = Parallel(n_jobs=workers, return_as="generator_unordered")(jobs)
    for entry in finished:
        done[entry.name] = entry
        index()
        progress.advance(note="" if entry.status == "ok" else f"{entry.name} failed: {entry.status}")
    progress.close()
    return index()
