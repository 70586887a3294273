"""Plans the sequences of a data set: names, parameters and splits, and what of it a folder holds already."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from odeform.dataset.folder import INDEX, open_folder
from odeform.dataset.index import Dataset, Entry, assign_splits, assign_splits_in_blocks
from odeform.errors import InputError
from odeform.schema import OBJECT
from odeform.simulation.scene import Scene

__all__ = ["counts", "finished", "plan"]


def plan(scene: Scene, count: int, seed: int, objects: Sequence[str] = (), corners: bool = False) -> list[Entry]:
    """Plans `count` sequences, of each of `objects` in a scene with several (default: all of them).

    Those of one object do not depend on which others are asked for. A longer plan starts with the shorter one, in a
    scene without objects from the scene's own count on. All sequences beyond that count are for training.
    """
    schema = scene.schema
    chosen = _chosen(scene, objects)
    stems = [f"{schema.scene}_{name}" for name in chosen] or [schema.scene]
    if chosen:
        splits = assign_splits_in_blocks(count, seed, scene.count)
    else:
        splits = assign_splits(min(count, scene.count), seed) + ["train"] * (count - scene.count)
    drawn = iter(scene.sample(count, seed, chosen))
    entries = [Entry(f"{stem}_{index:05d}", splits[index], next(drawn)) for stem in stems for index in range(count)]
    if corners:
        # in more than two dimensions hardly any drawn point is near a corner, but sliders reach them
        entries += [Entry(f"{schema.scene}_corner_{i:02d}", "train", at) for i, at in enumerate(schema.corners())]
    return entries


def _chosen(scene: Scene, objects: Sequence[str]) -> list[str]:
    """The objects asked for, in the order of the schema; `InputError` for unknown ones."""
    asked = [scene.schema.check_object(name) for name in objects] or scene.schema.objects
    return [name for name in scene.schema.objects if name in asked]


def counts(scene: Scene, count: int, objects: Sequence[str] = ()) -> int | dict[str, int]:
    """Counts the sequences for the provenance of a data set, by object in a scene with several."""
    return dict.fromkeys(_chosen(scene, objects), count) if scene.schema.objects else count


def finished(root: Path, entries: Sequence[Entry], new: Dataset) -> Dataset | None:
    """The data set that an earlier run left in the folder `root`, whose sequences are kept; None for an empty folder.

    It may be unfinished, shorter than the plan `entries`, or of other objects. Raises `InputError` for a data set
    whose sequences are not among those of the plan, or were simulated otherwise than `new`.
    """
    if not (root / INDEX).exists():
        return None
    old = open_folder(root)
    if not old.entries:
        return None
    for part in ("provenance", "fixed", "schema"):
        was, expected = (_without_count(getattr(dataset, part)) for dataset in (old, new))
        if was != expected:
            raise InputError(
                f"{root}: holds another data set, with {part} {was}; expected {expected} or an empty folder"
            )
    planned = {entry.name: entry for entry in entries}
    objects = {entry.parameters.get(OBJECT) for entry in entries}
    for entry in old.entries:
        same = planned.get(entry.name)
        if same is None and entry.parameters.get(OBJECT) not in objects:
            continue
        if same is None or (same.split, same.parameters) != (entry.split, entry.parameters):
            raise InputError(
                f"{root}: holds another data set, whose {entry.name} is not in this one: expected a count of at least "
                f"{old.provenance.get('count')} that keeps its splits, or an empty folder"
            )
    return old


def _without_count(value: Any) -> Any:
    return {k: v for k, v in value.items() if k != "count"} if isinstance(value, dict) else value
